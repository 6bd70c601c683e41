#pragma once
// Projection of points into the image.
#include <Eigen/Core>
#include <vector>

#include "capture/camera/camera_model.h"
#include "reconstruct/math/simd4.h"

namespace lumigraft::reconstruct {

/// Fast projection from the camera frame to pixels; lens distortion is interpolated from a table.
class PixelMap {
 public:
  explicit PixelMap(const capture::CameraModel& camera);
  Eigen::Vector2f pixel(float x_over_z, float y_over_z) const {
    const float u = fx_ * x_over_z + cx_, v = fy_ * y_over_z + cy_;
    return table_.empty() ? Eigen::Vector2f(u, v) : distorted(u, v);
  }
  void pixels(Simd4 x_over_z, Simd4 y_over_z, Simd4& u, Simd4& v) const {
    u = fx_ * x_over_z + cx_;
    v = fy_ * y_over_z + cy_;
    if (table_.empty()) return;
    for (int k = 0; k < 4; ++k) {
      const Eigen::Vector2f pixel = distorted(u[k], v[k]);
      u[k] = pixel.x();
      v[k] = pixel.y();
    }
  }

 private:
  Eigen::Vector2f distorted(float u, float v) const;

  static constexpr int kMargin = 32;
  float fx_, fy_, cx_, cy_;
  int width_, height_;
  std::vector<Eigen::Vector2f>
      table_;  ///< distorted pixel by undistorted pixel, with margin; empty if there is no distortion
};

}  // namespace lumigraft::reconstruct
