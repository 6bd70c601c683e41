#pragma once
// How sure a pose is.
#include <Eigen/Geometry>
#include <cmath>

namespace lumigraft {

/// Of an estimated T_tag_camera: the camera's place in metres (first three), then a turn about the camera in radians
/// (last three), both along the tag's axes: T_true = translation(δp) · T, with its rotation turned by δθ from the left.
using PoseCovariance = Eigen::Matrix<double, 6, 6>;

/// The step as above, taken from a pose.
inline Eigen::Isometry3d moved(const Eigen::Isometry3d& T_tag_camera, const Eigen::Matrix<double, 6, 1>& step) {
  Eigen::Isometry3d result = T_tag_camera;
  const Eigen::Vector3d turn = step.tail<3>();
  if (turn.norm() > 0)
    result.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix() * T_tag_camera.linear();
  result.translation() += step.head<3>();
  return result;
}

/// The step that leads from one pose to another: moved(from, step_between(from, to)) = to.
inline Eigen::Matrix<double, 6, 1> step_between(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to) {
  Eigen::Matrix<double, 6, 1> step;
  const Eigen::AngleAxisd turn(Eigen::Matrix3d(to.linear() * from.linear().transpose()));
  step << to.translation() - from.translation(), turn.angle() * turn.axis();
  return step;
}

/// From the covariance of a tag's turn about its own centre and its shift, in this order, both along the camera's axes.
inline PoseCovariance camera_covariance(const Eigen::Matrix<double, 6, 6>& of_tag,
                                        const Eigen::Isometry3d& T_camera_tag) {
  // The camera sits at -Rᵀt. A turn ω of the tag moves it by Rᵀ(ω × t), a shift s by -Rᵀs, and turns it by -Rᵀω.
  const Eigen::Matrix3d to_tag = T_camera_tag.linear().transpose();
  const Eigen::Vector3d t = T_camera_tag.translation();
  Eigen::Matrix3d cross_t;  // ω × t
  cross_t << 0, t.z(), -t.y(), -t.z(), 0, t.x(), t.y(), -t.x(), 0;
  Eigen::Matrix<double, 6, 6> j = Eigen::Matrix<double, 6, 6>::Zero();
  j.topLeftCorner<3, 3>() = to_tag * cross_t;
  j.topRightCorner<3, 3>() = -to_tag;
  j.bottomLeftCorner<3, 3>() = -to_tag;
  return j * of_tag * j.transpose();
}

/// 1σ of the place's and the turn's length.
inline double position_sigma_m(const PoseCovariance& covariance) {
  return std::sqrt(covariance.topLeftCorner<3, 3>().trace());
}
inline double angle_sigma_rad(const PoseCovariance& covariance) {
  return std::sqrt(covariance.bottomRightCorner<3, 3>().trace());
}

}  // namespace lumigraft
