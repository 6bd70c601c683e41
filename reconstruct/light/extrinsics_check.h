#pragma once
// Whether the fish-eye stands as it is said to: what it sees of the room, against what the colour camera saw there.
#include <Eigen/Geometry>
#include <optional>

#include "capture/session/session.h"
#include "reconstruct/field/distance_field.h"
#include "reconstruct/field/field_rays.h"
#include "reconstruct/field/metal_mask.h"
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

struct ExtrinsicsError {
  double turn_degrees = 0;  ///< by which T_tag_fisheye would explain the picture better
  double shift_m = 0;
};

/// Radiance in the field, seen from the probe, is compared with the fish-eye's, logarithm with logarithm and up to one
/// factor, over all directions in which both see the same surface. Where another pose near by or another turn makes
/// them agree far better, that is the likely error (seldom the only one: a turn and a shift may look alike). Empty
/// where the rig agrees, and where too little of the room is known to both, or too even, to tell.
std::optional<ExtrinsicsError> rig_error(const DistanceField& field, const FieldRays& rays, const MetalMask& metal,
                                         const Illumination& illumination, const capture::FisheyeCamera& camera);

}  // namespace lumigraft::reconstruct
