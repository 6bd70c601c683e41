#pragma once
// A brick that is being worked on, and what of it was published.
#include <cstdint>
#include <memory>

#include "reconstruct/distance_field.h"

namespace lumigraft {

struct WorkingBrick {
  BrickKey key{};
  FieldBrick now;
  std::shared_ptr<const FieldBrick> published;
  std::uint32_t looks = 0;         ///< pictures that said something about it
  std::uint32_t lively_until = 0;  ///< look, while what is there seems to change
  bool open = false;               ///< every voxel is known to be free, far from surfaces
  bool waiting = false;            ///< drifted slightly, to be published with others

  enum class Drift { none, slight, plain };
  /// How far `now` is from what was published. Slight: root mean squares over the brick exceed 2 % of a voxel (10 %
  /// away from surfaces), or half of what noise leaves uncertain where that is more; or 1 % of radiance. Plain: a voxel
  /// became known, or one alone differs by eight times as much.
  Drift drift(float voxel_m) const;
};

}  // namespace lumigraft
