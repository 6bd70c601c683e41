#pragma once
// A brick that is being worked on, and what of it was published.
#include <cstdint>
#include <memory>

#include "reconstruct/distance_field.h"

namespace lumigraft {

struct SurfaceBrick;

struct WorkingBrick {
  BrickKey key{};
  FieldBrick now;
  std::shared_ptr<const SurfaceBrick> model;  ///< of real surfaces in it; null without
  std::shared_ptr<const FieldBrick> published;
  std::uint32_t looks = 0;         ///< pictures that said something about it
  std::uint32_t last_look = 0;     ///< picture that was the last of them
  std::uint32_t lively_until = 0;  ///< look, while what is there seems to change
  /// By row, y + 8 z: what the last look at it found.
  std::uint64_t free_rows = 0;    ///< free, and known to be, all along
  std::uint64_t silent_rows = 0;  ///< nothing told
  std::uint32_t turn = 0;         ///< counts looks, whether they told anything or not
  bool open = false;              ///< every voxel is known to be free, far from surfaces
  bool waiting = false;           ///< to be published, if it drifted
  bool urgent = false;            ///< at once

  /// Whether `next` is away from what was published by more than 2 % of a voxel (10 % away from surfaces), root mean
  /// square over the brick, or half of what noise leaves uncertain where that is more; or by 1 % of radiance; or a
  /// voxel became known.
  bool drifted(const FieldBrick& next, float voxel_m) const;
};

}  // namespace lumigraft
