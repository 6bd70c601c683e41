#pragma once
// The plane that depth measures inside a tag.
#include <Eigen/Core>
#include <optional>

#include "capture/camera/camera_model.h"
#include "capture/image.h"
#include "reconstruct/pose/tag.h"

namespace lumigraft::reconstruct {

struct DepthPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();         ///< unit, camera frame, towards the camera
  double angle_sigma_rad = 0;                               ///< 1σ of the normal
  Eigen::Vector3d inverse_depth = Eigen::Vector3d::Zero();  ///< 1/z = its dot product with (x/z, y/z, 1)
};

/// Robust least-squares plane through the depth inside the corners. Empty if too few pixels have depth on one plane.
std::optional<DepthPlane> plane_inside(const capture::Image<float>& depth_m, const capture::CameraModel& camera,
                                       const TagCorners& corners);

}  // namespace lumigraft::reconstruct
