#pragma once
// The plane that depth measures inside a tag: the tag's orientation, its distance, and so its size.
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "capture/camera/camera_model.h"
#include "capture/image.h"
#include "reconstruct/pose/tag.h"

namespace lumigraft::reconstruct {

struct DepthPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();         ///< unit, camera frame, towards the camera
  double angle_sigma_rad = 0;                               ///< 1σ of the normal
  Eigen::Vector3d inverse_depth = Eigen::Vector3d::Zero();  ///< 1/z = its dot product with (x/z, y/z, 1)
};

/// The surface around a tag, where depth continues the plane inside it: a larger plane has a better known normal.
struct SurroundingPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();      ///< unit, camera frame, towards the camera
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of the normal: noise, and distortion of depth
};

/// Empty if depth inside the corners is no plane.
std::optional<SurroundingPlane> plane_around(const capture::Image<float>& depth_m, const capture::CameraModel& camera,
                                             const TagCorners& corners, const capture::DepthNoise& noise = {});

/// Robust least-squares plane through the depth inside the corners. Empty if too few pixels have depth on one plane.
std::optional<DepthPlane> plane_inside(const capture::Image<float>& depth_m, const capture::CameraModel& camera,
                                       const TagCorners& corners);

/// Compares a tag's configured size with depth.
class TagSizeCheck {
 public:
  TagSizeCheck(int id, double size_m) : id_(id), size_m_(size_m) {}

  /// Adds a frame: the depth plane inside the tag, and the tag's pose.
  void add(const DepthPlane& plane, const Eigen::Isometry3d& T_camera_tag);
  /// Empty if depth agrees, or has too few frames.
  std::string warning() const;

 private:
  int id_;
  double size_m_;
  int count_ = 0;
  double mean_ = 0;  ///< of the logarithm of measured depth over that of the pose
  double distance_m_ = 0;
};

}  // namespace lumigraft::reconstruct
