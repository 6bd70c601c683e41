#pragma once
// When albedo, and with it the lamps, is worth solving again. It takes hundreds of milliseconds and changes slowly.
//
// Where a solution tells next to nothing new, the next one waits twice as long, up to kMostPatience times: as long as
// nothing moves and the light stays. What is left out then is what one more solution would have changed: less than
// kLittle of the albedo, kLittle of the light, and of the room what kMoved of its bricks hold.
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "reconstruct/albedo/albedo.h"
#include "reconstruct/field/distance_field.h"
#include "reconstruct/light/light.h"

namespace lumigraft::server {

class AlbedoSchedule {
 public:
  static constexpr int kFrames = 8;              ///< in lock step: solved again after as many, where anything changed
  static constexpr double kMuchMoreRoom = 1.25;  ///< or at once, when the field has grown by a quarter
  static constexpr double kMuchLight = 0.2;      ///< or the lamps' irradiance changed by a fifth of its sum

  /// True when nothing was solved, or what was solved is far from what is known now.
  bool changed_much(const reconstruct::DistanceField& field, const reconstruct::Illumination& light) const;
  bool changed(const reconstruct::DistanceField& field, const reconstruct::Illumination& light) const;
  /// Whether something moved since that solutions should follow, or the light changed by more than a little.
  bool moved(const reconstruct::DistanceField& field, const reconstruct::Illumination& light) const;
  /// Lock step's rule; counts frames.
  bool due(const reconstruct::DistanceField& field, const reconstruct::Illumination& light);
  /// What is being solved, before it is.
  void begin(std::shared_ptr<const reconstruct::DistanceField> field, const reconstruct::Illumination& light);
  /// What came of it; null: nothing.
  void solved(std::shared_ptr<const reconstruct::AlbedoField> albedo);

  static constexpr int kMostPatience = 8;
  static constexpr float kLittle = 0.01f;  ///< of albedo, of light
  static constexpr float kFew = 0.05f;     ///< of samples, newly known; of their standard deviation
  static constexpr float kMoved = 0.005f;  ///< of the bricks
  /// Times the usual wait until it is solved again.
  int patience() const { return patience_; }

 private:
  struct Known {
    std::shared_ptr<const reconstruct::DistanceField> field;
    std::uint64_t light_version;
    std::vector<reconstruct::PointLight> lights;
  };
  double light_change(const reconstruct::Illumination& light) const;

  std::optional<Known> known_;
  std::shared_ptr<const reconstruct::AlbedoField> albedo_;
  int frames_since_ = 0, patience_ = 1;
  bool disturbed_ = true;  ///< what is being solved was much, or something moved
};

}  // namespace lumigraft::server
