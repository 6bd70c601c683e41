#pragma once
// The plane that depth shows inside the tag.
#include <Eigen/Core>
#include <optional>

#include "capture/camera/camera_model.h"
#include "capture/image.h"
#include "reconstruct/pose/tag.h"

namespace lumigraft::reconstruct {

struct DepthPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit, camera frame, towards the camera
  double angle_sigma_rad = 0;
  Eigen::Vector3d inverse_depth = Eigen::Vector3d::Zero();  ///< 1/z at (x/z, y/z, 1) is the product with it
};

/// Empty where depth has too many holes there, or is no plane.
std::optional<DepthPlane> plane_inside(const capture::Image<float>& depth_m, const capture::CameraModel& camera,
                                       const TagCorners& corners);

}  // namespace lumigraft::reconstruct
