#pragma once
// Pixels of points in single precision, for points that the camera surely sees or nearly does: CameraModel::project
// also finds out where a distorted image folds back, which takes several times as long.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <optional>

#include "capture/camera/camera_model.h"

namespace lumigraft::relight {

class ViewProjection {
 public:
  ViewProjection(const capture::CameraModel& camera, const Eigen::Isometry3f& T_tag_camera)
      : camera_(camera), T_camera_tag_(T_tag_camera.inverse()) {
    for (std::size_t i = 0; i < 5; ++i) k_[i] = static_cast<float>(camera.distortion[i]);
    // Where r (1 + k1 r² + k2 r⁴ + k3 r⁶) stops growing the image folds back.
    constexpr float kStep = 0.01f, kEnd = 25;  // tan² of 79 degrees
    for (float s = 0; s < std::min(kEnd, max_square_); s += kStep) {
      if (!(1 + s * (3 * k_[0] + s * (5 * k_[1] + s * 7 * k_[4])) > 0)) max_square_ = s;
    }
  }

  /// `p_m`: tag frame. Empty: behind the camera, beyond its field of view, or where distortion folds the image back.
  std::optional<Eigen::Vector2f> pixel(const Eigen::Vector3f& p_m) const {
    const Eigen::Vector3f p = T_camera_tag_ * p_m;
    if (camera_.kind != capture::CameraModel::Kind::pinhole) {
      const auto pixel = camera_.project(p.cast<double>());
      return pixel ? std::optional(pixel->cast<float>().eval()) : std::nullopt;
    }
    if (!(p.z() > 0)) return std::nullopt;
    const float x = p.x() / p.z(), y = p.y() / p.z(), s = x * x + y * y;
    if (s > max_square_) return std::nullopt;
    const float radial = 1 + s * (k_[0] + s * (k_[1] + s * k_[4]));
    const float u = x * radial + 2 * k_[2] * x * y + k_[3] * (s + 2 * x * x),
                v = y * radial + k_[2] * (s + 2 * y * y) + 2 * k_[3] * x * y;
    return Eigen::Vector2f(static_cast<float>(camera_.fx) * u + static_cast<float>(camera_.cx),
                           static_cast<float>(camera_.fy) * v + static_cast<float>(camera_.cy));
  }

 private:
  capture::CameraModel camera_;
  Eigen::Isometry3f T_camera_tag_;
  std::array<float, 5> k_;
  float max_square_ = std::numeric_limits<float>::infinity();  ///< of the tangent of the angle to the axis
};

}  // namespace lumigraft::relight
