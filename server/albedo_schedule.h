#pragma once
// When albedo is worth solving again. It takes hundreds of milliseconds and changes slowly.
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "reconstruct/distance_field.h"
#include "reconstruct/light.h"

namespace lumigraft {

class AlbedoSchedule {
 public:
  static constexpr int kFrames = 8;              ///< in lock step: solved again after as many, where anything changed
  static constexpr double kMuchMoreRoom = 1.25;  ///< or at once, when the field has grown by a quarter
  static constexpr double kMuchLight = 0.2;      ///< or the lamps' irradiance changed by a fifth of its sum

  /// True when nothing was solved, or what was solved is far from what is known now.
  bool changed_much(const DistanceField& field, const Illumination& light) const;
  bool changed(const DistanceField& field, const Illumination& light) const;
  /// Lock step's rule; counts frames.
  bool due(const DistanceField& field, const Illumination& light);
  void solved(const DistanceField& field, const Illumination& light);

 private:
  struct Known {
    std::uint64_t field_version, light_version;
    std::size_t bricks;
    std::vector<PointLight> lights;
  };
  std::optional<Known> known_;
  int frames_since_ = 0;
};

}  // namespace lumigraft
