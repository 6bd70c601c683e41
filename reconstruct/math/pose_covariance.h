#pragma once
// How sure a pose is.
#include <Eigen/Geometry>

namespace lumigraft::reconstruct {

/// Of an estimated T_tag_camera: the camera's place in metres (first three), then a turn about the camera in radians
/// (last three), both along the tag's axes: T_true = translation(δp) · T, with its rotation turned by δθ from the left.
using PoseCovariance = Eigen::Matrix<double, 6, 6>;

/// The step as above, taken from a pose.
Eigen::Isometry3d moved(const Eigen::Isometry3d& T_tag_camera, const Eigen::Matrix<double, 6, 1>& step);

/// The step that leads from one pose to another: moved(from, step_between(from, to)) = to.
Eigen::Matrix<double, 6, 1> step_between(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to);

/// From the covariance of a tag's turn about its own centre and its shift, in this order, both along the camera's axes.
PoseCovariance camera_covariance(const Eigen::Matrix<double, 6, 6>& of_tag, const Eigen::Isometry3d& T_camera_tag);

/// C⁻¹, and from it C again: what adds up where estimates are averaged.
PoseCovariance information_of(const PoseCovariance& covariance);

/// x of A x = b, for a symmetric A (LDLᵀ): the step of normal equations. Here so that it is compiled once.
Eigen::Matrix<double, 6, 1> solved(const Eigen::Matrix<double, 6, 6>& a, const Eigen::Matrix<double, 6, 1>& b);

/// How far a step is, in units of its uncertainty: δᵀ C⁻¹ δ (Mahalanobis 1936), six on average where C is true.
double squared_sigmas(const Eigen::Matrix<double, 6, 1>& step, const PoseCovariance& covariance);

/// 1σ of the place's and the turn's length.
double position_sigma_m(const PoseCovariance& covariance);
double angle_sigma_rad(const PoseCovariance& covariance);

}  // namespace lumigraft::reconstruct
