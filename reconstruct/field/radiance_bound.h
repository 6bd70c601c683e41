#pragma once
// Voxels of which the field has a lower bound of radiance and nothing better.
#include "reconstruct/field/distance_field.h"

namespace lumigraft::reconstruct {

/// Whether a voxel's colour was observed and clipped in all frames: its radiance is a lower bound in the channels of
/// FieldBrick::clipped_channels().
inline bool radiance_is_bound(const FieldBrick& brick, std::size_t voxel) {
  return !(brick.radiance_weight(voxel) > 0) && !brick.radiance(voxel).isZero(0);
}

}  // namespace lumigraft::reconstruct
