#pragma once
// Check of the configured pose of the fish-eye against the radiance that the colour camera measured in the field.
#include <Eigen/Geometry>
#include <optional>

#include "capture/session/session.h"
#include "reconstruct/field/distance_field.h"
#include "reconstruct/field/field_rays.h"
#include "reconstruct/field/real_surface_mesh.h"
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

struct ExtrinsicsError {
  double turn_degrees = 0;  ///< of T_tag_fisheye, to the pose that explains the image better
  double shift_m = 0;
};

/// Compares log radiance of the field, seen from the probe, with the fish-eye's, up to one common factor, over all
/// directions in which both see the same surface. If another pose near by or another rotation agrees far better, that
/// is the likely error (rotations and shifts can look alike). Empty if the configured pose agrees, and if too little of
/// the room, or too uniform a room, was measured by both.
std::optional<ExtrinsicsError> extrinsics_error(const DistanceField& field, const FieldRays& rays,
                                                const MetalMask& metal, const Illumination& illumination,
                                                const capture::FisheyeCamera& camera);

}  // namespace lumigraft::reconstruct
