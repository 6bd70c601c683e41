#pragma once
// Temporal filter of poses: the mean of recent poses for a camera at rest, the newest one for a moving camera.
#include <Eigen/Geometry>

namespace lumigraft::reconstruct {

class PoseFilter {
 public:
  /// Returns the filtered T_camera_tag. `position_sigma_m`, `angle_sigma_rad`: 1σ of the measurement's noise from frame
  /// to frame.
  Eigen::Isometry3d update(const Eigen::Isometry3d& T_camera_tag, double position_sigma_m, double angle_sigma_rad);
  void reset() { count_ = 0; }
  /// Number of measurements in the last mean.
  double count() const { return count_; }

 private:
  double count_ = 0;  ///< effective number of measurements in the mean; 0 = none
  Eigen::Vector3d position_ = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation_ = Eigen::Quaterniond::Identity();
  Eigen::Matrix<double, 6, 1> drift_ = Eigen::Matrix<double, 6, 1>::Zero();  ///< running mean of the innovations, in σ
};

}  // namespace lumigraft::reconstruct
