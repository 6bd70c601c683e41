#pragma once
// Decides when albedo and lamps are solved again. A solution takes hundreds of milliseconds and changes slowly.
//
// After a solution that changed little the wait is doubled, up to kMaxPatience times, as long as neither the room nor
// the light changes. The error of waiting is what another solution would have changed: less than kLittle of the albedo,
// kLittle of the light, and kMoved of the room's bricks.
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "reconstruct/albedo/albedo.h"
#include "reconstruct/field/distance_field.h"
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

/// Fraction of the field's bricks that are new, or whose mean radiance changed by more than kOtherRadiance: moved or
/// newly seen surfaces, but not drift caused by noise.
float moved_fraction(const DistanceField& now, const DistanceField& before);
constexpr float kOtherRadiance = 0.05f;

/// Difference of two successive solutions, over surface samples.
struct AlbedoDelta {
  float change = 0;       ///< sum of absolute changes over the sum of albedo, where both are known
  float newly_known = 0;  ///< fraction of the known samples that were unknown before
  float surer = 0;        ///< relative decrease of their standard deviation; negative: an increase
};
AlbedoDelta compare_albedo(const AlbedoField& now, const AlbedoField& before);

/// Kind of solution: of new and changed samples only (solve_incremental), or of the lamps and all samples.
enum class AlbedoWork { nothing, incremental, everything };

/// Waiting time of a schedule. A live pipeline waits in proportion to the work done; offline, frames are counted.
class AlbedoPace {
 public:
  virtual ~AlbedoPace() = default;
  /// Called whenever the schedule decides; offline, once per frame.
  virtual void asked() {}
  /// Whether `periods` usual waits have passed since work of this kind. `learning`: much is unknown, waits are shorter.
  virtual bool waited(AlbedoWork work, int periods, bool learning) const = 0;
  /// Whether fields may be compared now to find moved surfaces, which takes milliseconds.
  virtual bool may_compare() = 0;
  virtual void begin(AlbedoWork work) = 0;
  virtual void end() {}
};

/// Offline: a period is kFrames frames. While learning, every frame is solved.
class FramePace : public AlbedoPace {
 public:
  static constexpr int kFrames = 8;

  void asked() override { ++frames_; }
  bool waited(AlbedoWork, int periods, bool learning) const override {
    return learning || frames_ >= kFrames * periods;
  }
  bool may_compare() override { return frames_ % kFrames == 0; }
  void begin(AlbedoWork) override { frames_ = 0; }

 private:
  int frames_ = 0;  ///< since the last work
};

class AlbedoSchedule {
 public:
  static constexpr double kMuchMoreRoom = 1.25;    ///< ratio of bricks above which a solution is due at once
  static constexpr double kMuchLight = 0.2;        ///< the same for the relative change of the lamps' irradiance
  static constexpr float kMovedLamp_rad = 0.014f;  ///< 0.8°: a lamp that turned farther is searched again at once
  static constexpr int kMaxPatience = 8;
  static constexpr float kLittle = 0.01f;  ///< relative change of albedo or light
  static constexpr float kFew = 0.05f;     ///< fraction of newly known samples; relative decrease of their deviation
  static constexpr float kMoved = 0.005f;  ///< fraction of the bricks

  explicit AlbedoSchedule(std::unique_ptr<AlbedoPace> pace = std::make_unique<FramePace>());

  /// The work that is due now.
  AlbedoWork next(const DistanceField& field, const Illumination& light);
  /// Whether everything may be solved now if an incremental solution turns out to be invalid.
  bool may_solve_everything() const { return may_solve_everything_; }

  /// Marks work of a kind from its construction to the end of the block.
  class Work {
   public:
    Work(AlbedoSchedule& schedule, AlbedoWork work) : pace_(*schedule.pace_) { pace_.begin(work); }
    ~Work() { pace_.end(); }
    Work(const Work&) = delete;
    Work& operator=(const Work&) = delete;

   private:
    AlbedoPace& pace_;
  };
  /// Called before a solution, with its input.
  void begin(std::shared_ptr<const DistanceField> field, const Illumination& light);
  /// Called with its result; `everything_due`: it was incremental, and everything should be solved next.
  void solved(std::shared_ptr<const AlbedoField> albedo, bool everything_due);
  /// Called if an incremental solution is not valid: the next one is of everything, when its wait is over.
  void wait_for_everything();

  /// Whether nothing is solved yet, or room or light at the last decision differed much from those solved.
  bool learning() const { return learning_; }
  /// Whether more than kMoved of the bricks, or more than kLittle of the light, changed since the last solution.
  bool moved(const DistanceField& field, const Illumination& light) const;
  /// Wait until the next solution, as a multiple of the usual one.
  int patience() const { return patience_; }

 private:
  struct Known {
    std::shared_ptr<const DistanceField> field;
    std::uint64_t light_version;
    std::vector<PointLight> lights;
  };
  double light_change(const Illumination& light) const;
  bool lamp_moved(const Illumination& light) const;
  bool changed_much(const DistanceField& field, const Illumination& light) const;
  bool changed(const DistanceField& field, const Illumination& light) const;

  std::unique_ptr<AlbedoPace> pace_;
  std::optional<Known> known_, known_before_;
  std::shared_ptr<const AlbedoField> albedo_;
  int patience_ = 1;
  bool disturbed_ = true;  ///< the solution's input changed much, or something moved
  bool learning_ = true;
  bool everything_due_ = true, only_everything_ = true;  ///< the first solution cannot be incremental
  bool may_solve_everything_ = true;
};

}  // namespace lumigraft::reconstruct
