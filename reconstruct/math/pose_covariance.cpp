#include "reconstruct/math/pose_covariance.h"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "reconstruct/math/rotation_vector.h"

namespace lumigraft::reconstruct {

Eigen::Isometry3d apply_step(const Eigen::Isometry3d& T_tag_camera, const Eigen::Matrix<double, 6, 1>& step) {
  return isometry(rotation_by(step.tail<3>()) * T_tag_camera.linear(), T_tag_camera.translation() + step.head<3>());
}

Eigen::Matrix<double, 6, 1> step_between(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to) {
  Eigen::Matrix<double, 6, 1> step;
  step << to.translation() - from.translation(), rotation_vector(to.linear() * from.linear().transpose());
  return step;
}

Eigen::Matrix3d cross_with(const Eigen::Vector3d& arm) {
  Eigen::Matrix3d m;
  m << 0, arm.z(), -arm.y(), -arm.z(), 0, arm.x(), arm.y(), -arm.x(), 0;
  return m;
}

PoseCovariance camera_covariance(const Eigen::Matrix<double, 6, 6>& tag_covariance,
                                 const Eigen::Isometry3d& T_camera_tag) {
  // The camera is at -Rᵀt. A rotation ω of the tag moves it by Rᵀ(ω × t) and rotates it by -Rᵀω; a translation s
  // moves it by -Rᵀs.
  const Eigen::Matrix3d to_tag = T_camera_tag.linear().transpose();
  Eigen::Matrix<double, 6, 6> j = Eigen::Matrix<double, 6, 6>::Zero();
  j.topLeftCorner<3, 3>() = to_tag * cross_with(T_camera_tag.translation());
  j.topRightCorner<3, 3>() = -to_tag;
  j.bottomLeftCorner<3, 3>() = -to_tag;
  return j * tag_covariance * j.transpose();
}

PoseCovariance information_of(const PoseCovariance& covariance) {
  return covariance.ldlt().solve(PoseCovariance::Identity());
}

Eigen::Matrix<double, 6, 1> solved(const Eigen::Matrix<double, 6, 6>& a, const Eigen::Matrix<double, 6, 1>& b) {
  return a.ldlt().solve(b);
}

PoseCovariance larger_part(const PoseCovariance& a, const PoseCovariance& b) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<PoseCovariance> principal(a, b);
  const PoseCovariance& v = principal.eigenvectors();
  const Eigen::Matrix<double, 6, 1> larger = (principal.eigenvalues().array() > 1).cast<double>();
  return b * v * larger.asDiagonal() * v.transpose();
}

double squared_mahalanobis(const Eigen::Matrix<double, 6, 1>& step, const PoseCovariance& covariance) {
  return step.dot(solved(covariance, step));
}

double position_sigma_m(const PoseCovariance& covariance) {
  return std::sqrt(covariance.topLeftCorner<3, 3>().trace());
}

double angle_sigma_rad(const PoseCovariance& covariance) {
  return std::sqrt(covariance.bottomRightCorner<3, 3>().trace());
}

}  // namespace lumigraft::reconstruct
