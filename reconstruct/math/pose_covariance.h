#pragma once
// Covariance of a camera pose, and the six-dimensional steps it refers to.
#include <Eigen/Geometry>

namespace lumigraft::reconstruct {

/// The matrix M with M ω = ω × arm: how a rotation vector ω moves the end of an arm.
Eigen::Matrix3d cross_with(const Eigen::Vector3d& arm);

/// Covariance of an estimated T_tag_camera: camera position in metres (first three), then a rotation vector about the
/// camera in radians (last three), both in the tag frame. True position = position + δp, true rotation = exp(δθ) · R.
using PoseCovariance = Eigen::Matrix<double, 6, 6>;

/// Applies such a step (δp, δθ) to a pose.
Eigen::Isometry3d apply_step(const Eigen::Isometry3d& T_tag_camera, const Eigen::Matrix<double, 6, 1>& step);

/// The step from one pose to another: apply_step(from, step_between(from, to)) = to.
Eigen::Matrix<double, 6, 1> step_between(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to);

/// Camera covariance from a tag's: rotation about the tag's centre, then translation, both in the camera frame.
PoseCovariance camera_covariance(const Eigen::Matrix<double, 6, 6>& tag_covariance,
                                 const Eigen::Isometry3d& T_camera_tag);

/// C⁻¹, the information matrix: information of independent estimates adds up. Applied twice it gives C again.
PoseCovariance information_of(const PoseCovariance& covariance);

/// Solves A x = b for a symmetric A (LDLᵀ), as in normal equations. Not inline, so that Eigen's code is compiled once.
Eigen::Matrix<double, 6, 1> solved(const Eigen::Matrix<double, 6, 6>& a, const Eigen::Matrix<double, 6, 1>& b);

/// Projector P onto the directions in which the information A exceeds B: P A Pᵀ = Σ λ B v vᵀ B over A v = λ B v with
/// λ > 1 and vᵀ B v = 1. Both symmetric, B positive definite.
Eigen::Matrix<double, 6, 6> larger_part(const Eigen::Matrix<double, 6, 6>& a, const Eigen::Matrix<double, 6, 6>& b);

/// Squared Mahalanobis distance δᵀ C⁻¹ δ (Mahalanobis 1936); its mean is 6 if C is correct.
double squared_mahalanobis(const Eigen::Matrix<double, 6, 1>& step, const PoseCovariance& covariance);

/// Root of the traces: 1σ of the length of the position and of the rotation error.
double position_sigma_m(const PoseCovariance& covariance);
double angle_sigma_rad(const PoseCovariance& covariance);

}  // namespace lumigraft::reconstruct
