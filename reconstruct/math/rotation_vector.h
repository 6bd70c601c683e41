#pragma once
// Rotations as axis times angle in radians, and rigid transforms.
#include <Eigen/Geometry>

namespace lumigraft::reconstruct {

inline Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

inline Eigen::Matrix3d rotation_by(const Eigen::Vector3d& vector) {
  if (!(vector.norm() > 0)) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(vector.norm(), vector.normalized()).toRotationMatrix();
}

inline Eigen::Isometry3d isometry(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = rotation;
  T.translation() = translation;
  return T;
}

/// In radians, from 0 to π.
inline double angle_between(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return Eigen::AngleAxisd(Eigen::Matrix3d(a.linear().transpose() * b.linear())).angle();
}

}  // namespace lumigraft::reconstruct
