#include "reconstruct/pose/filter.h"

#include <algorithm>

#include "reconstruct/math/rotation_vector.h"
#include "reconstruct/pose/parameters.h"

namespace lumigraft::reconstruct {
Eigen::Isometry3d PoseFilter::update(const Eigen::Isometry3d& T_camera_tag, double position_sigma_m,
                                     double angle_sigma_rad) {
  const Eigen::Vector3d position = T_camera_tag.translation();
  const Eigen::Quaterniond rotation(T_camera_tag.linear());
  if (count_ == 0) {
    count_ = 1;
    position_ = position;
    rotation_ = rotation;
    drift_.setZero();
  } else {
    const Eigen::AngleAxisd turn(rotation_.conjugate() * rotation);
    Eigen::Matrix<double, 6, 1> innovation;
    innovation.head<3>() = (position - position_) / position_sigma_m;
    innovation.tail<3>() = turn.angle() / angle_sigma_rad * turn.axis();
    drift_ += kPoseFilter.drift_rate * (innovation - drift_);
    // One large innovation is a jump; innovations that keep pointing in one direction are a slow motion.
    const double jump = std::max(innovation.head<3>().norm(), innovation.tail<3>().norm()) / kPoseFilter.jump_sigmas;
    const double drift = std::max(drift_.head<3>().norm(), drift_.tail<3>().norm()) / kPoseFilter.drift_sigmas;
    const double motion = std::max(jump, drift);
    count_ = std::min(count_ + 1, kPoseFilter.max_count);
    if (motion > 1) count_ = std::max(1.0, count_ / (motion * motion));
    position_ += (position - position_) / count_;
    rotation_ = rotation_.slerp(1 / count_, rotation).normalized();
  }
  return isometry(rotation_.toRotationMatrix(), position_);
}

}  // namespace lumigraft::reconstruct
