#pragma once
// A world frame without a tag: on the largest level surface that the first view shows.
#include <Eigen/Geometry>
#include <optional>

#include "reconstruct/pose/icp.h"

namespace lumigraft::reconstruct {

/// The world frame: z is the surface's normal, the origin is the point of it nearest to the middle of the image, and x
/// points to the camera's right. A surface is level if its normal points upwards in the image, as a floor's or a
/// table's does in a camera that is not tilted sideways by more than 45° nor upwards; without such a surface of a tenth
/// of all that is seen, the largest plane is used. Empty if no plane is that large.
std::optional<PoseEstimate> anchored_on_surface(const DepthGrid& grid);

}  // namespace lumigraft::reconstruct
