#pragma once
// Poses of a square from its four corners in the image.
#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

#include "reconstruct/math/pose_covariance.h"

namespace lumigraft::reconstruct {

/// Corners as x/z, y/z in front of the camera, order as TagCorners.
using SquareCorners = std::array<Eigen::Vector2d, 4>;

/// Corners of a tag's black square in its frame.
std::array<Eigen::Vector3d, 4> tag_corners(double size_m);

/// Row by row; the last entry is 1.
using Homography = Eigen::Matrix<double, 8, 1>;

/// From the plane of a square of this size to the plane of `corners`; empty for corners on a line.
std::optional<Homography> square_homography(double size, const std::array<Eigen::Vector2d, 4>& corners);

struct PlanarPose {
  Eigen::Isometry3d T_camera_tag = Eigen::Isometry3d::Identity();
  double error = 0;  ///< RMS over the corners, in the units of x/z
};

/// Both local minima of the reprojection error, the better first (Schweighofer & Pinz 2006: in weak perspective a plane
/// and its mirror image along the line of sight project alike). One if they coincide; none if the corners are not those
/// of a square in front of the camera.
std::vector<PlanarPose> solve_square(const SquareCorners& corners, double size_m);

/// Covariance of the camera pose for corners with errors of `corner_sigma` (1σ of x/z and y/z each).
PoseCovariance square_covariance(const Eigen::Isometry3d& T_camera_tag, double size_m, double corner_sigma);

/// Covariance of the camera pose for corners that are all displaced by plus or minus `displacement` (x/z, y/z), with
/// the same sign. Not linearised: near the frontal view a small shear of the corners is a large tilt.
PoseCovariance displaced_covariance(const Eigen::Isometry3d& T_camera_tag, double size_m,
                                    const SquareCorners& displacement);

/// The pose mirrored along the line of sight to the tag's centre: to first order the other minimum.
Eigen::Isometry3d mirrored(const Eigen::Isometry3d& T_camera_tag);

/// RMS distance of the projected corners from the given ones, in the units of x/z.
double square_error(const Eigen::Isometry3d& T_camera_tag, const SquareCorners& corners, double size_m);

}  // namespace lumigraft::reconstruct
