#pragma once
// Poses of a square from its four corners.
#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "reconstruct/math/pose_covariance.h"

namespace lumigraft::reconstruct {

/// Corners as x/z, y/z in front of the camera, order as TagCorners.
using SquareCorners = std::array<Eigen::Vector2d, 4>;

struct PlanarPose {
  Eigen::Isometry3d T_camera_tag = Eigen::Isometry3d::Identity();
  double error = 0;  ///< RMS over the corners, in the units of x/z
};

/// Both local minima of the reprojection error (Schweighofer & Pinz 2006: a plane seen in weak perspective looks the
/// same when mirrored along the line of sight), the better first. One where they coincide; none where the corners are
/// no square in front of the camera.
std::vector<PlanarPose> solve_square(const SquareCorners& corners, double size_m);

/// How sure a pose is whose corners are off by `corner_sigma` (1σ of x/z and y/z each).
PoseCovariance square_covariance(const Eigen::Isometry3d& T_camera_tag, double size_m, double corner_sigma);

/// The tag's plane mirrored along the line of sight to its centre: where the other explanation lies, to first order.
Eigen::Isometry3d mirrored(const Eigen::Isometry3d& T_camera_tag);

/// RMS distance of the projected corners from the given ones, in the units of x/z.
double square_error(const Eigen::Isometry3d& T_camera_tag, const SquareCorners& corners, double size_m);

}  // namespace lumigraft::reconstruct
