#pragma once
// The exhibit with all changes that viewers made. Any thread.
#include <Eigen/Geometry>
#include <chrono>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "reconstruct/scene.h"
#include "relight/exhibit/loading.h"
#include "relight/objects/standing.h"
#include "server/stream/protocol.h"

namespace lumigraft::server {

/// The exhibit at the place that the scene's pose gives its frame, standing on the scene's surface.
relight::Exhibit shown_exhibit(const relight::Exhibit& exhibit, const reconstruct::Scene& scene, double time_s,
                               relight::Standing& standing);

/// What viewers can do with an exhibit.
struct ExhibitLimits {
  std::optional<Eigen::AlignedBox3d> bounds_m;  ///< of the objects' positions, tag frame
  std::optional<double> reset_after_s;          ///< without a command, the exhibit is again as configured
  std::filesystem::path saved_file = {};        ///< for what an operator saves (saved_exhibit.h); empty: none
};

class ExhibitState {
 public:
  using Clock = std::chrono::steady_clock;

  explicit ExhibitState(relight::Exhibit exhibit, ExhibitLimits limits = {});

  std::shared_ptr<const relight::Exhibit> newest() const;
  /// The same for a frame of this time. Animations begin with the first such frame, and what viewers change of them
  /// counts from the last.
  std::shared_ptr<const relight::Exhibit> at(double time_s);
  /// Gives a model to an object that has none. Throws what `give` throws.
  void give_model(std::size_t index, const relight::GiveModel& give);
  std::size_t models_given() const;  ///< so far
  /// Another exhibit in place of this one, as configured.
  void replace(relight::Exhibit exhibit, ExhibitLimits limits);
  std::size_t replaced() const;  ///< so often
  /// The object that the command means; empty if there is none.
  std::optional<relight::VirtualObject> object(const ObjectCommand& command) const;
  /// Returns the error of the command, if any. `on_pixel` counts for nothing here. An object that a viewer moves or
  /// turns no longer follows its key frames. Positions are moved into the bounds.
  std::optional<std::string> apply(const ObjectCommand& command, Clock::time_point now = Clock::now());
  /// Puts everything back as configured if that is due, and something was changed. True if it did.
  bool reset_if_idle(Clock::time_point now = Clock::now());
  /// Writes what is shown to the limits' file; from then on it counts as configured. Animations that play begin at
  /// their beginning. Throws std::runtime_error, and then changes nothing.
  void save();
  /// The objects as a JSON array, for the messages `hello` and `state`.
  std::string objects_json() const;

 private:
  /// The box around the model of an object at rest.
  struct Bounds {
    std::shared_ptr<const relight::Model> model;
    Eigen::AlignedBox3f box_m;  ///< in the model's frame; empty while there is no model
  };

  void begin(relight::Exhibit exhibit);
  const Eigen::AlignedBox3f& bounds_of(std::size_t index) const;
  relight::Exhibit as_start() const;
  void reset(relight::Exhibit& exhibit, std::size_t index);

  mutable std::mutex mutex_;
  ExhibitLimits limits_;
  relight::Exhibit configured_;
  std::shared_ptr<const relight::Exhibit> exhibit_;
  std::optional<Clock::time_point> last_command_;  ///< since it was as configured
  std::vector<Eigen::Quaterniond> rest_;           ///< rotations before viewers changed them
  std::vector<double> yaw_degrees_;
  mutable std::vector<Bounds> bounds_;  ///< by object, of the models for which they were last asked
  std::optional<double> time_s_;        ///< of the last frame
  std::size_t models_given_ = 0, replaced_ = 0;
};

}  // namespace lumigraft::server
