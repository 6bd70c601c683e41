#pragma once
// Poses over time: a camera that stands still gets the mean of its poses, a moving one the newest.
#include <Eigen/Geometry>
#include <cstdint>

namespace lumigraft::reconstruct {

class PoseFilter {
 public:
  /// `position_sigma_m`, `angle_sigma_rad`: 1σ of this measurement's noise from frame to frame.
  Eigen::Isometry3d update(const Eigen::Isometry3d& T_camera_tag, double position_sigma_m, double angle_sigma_rad);
  void reset() { count_ = 0; }
  /// How many measurements the last result is the mean of.
  double count() const { return count_; }

 private:
  double count_ = 0;  ///< how many measurements the mean stands for; 0 = nothing yet
  Eigen::Vector3d position_ = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation_ = Eigen::Quaterniond::Identity();
  Eigen::Matrix<double, 6, 1> drift_ = Eigen::Matrix<double, 6, 1>::Zero();  ///< recent innovations, in σ
};

}  // namespace lumigraft::reconstruct
