#pragma once
// View directions of a camera's pixels.
#include <cstddef>
#include <vector>

#include "relight/tracing/trace_scene.h"

namespace lumigraft::relight {

/// From the left to the central pixel of a square of so many; of two, the right one.
constexpr int central_offset(int edge) { return edge / 2; }

/// Directions are computed at the pixels' corners, linear between.
class PixelRays {
 public:
  explicit PixelRays(const capture::CameraModel& camera);
  /// Unit, camera frame; `within`: position in the pixel, [0, 1)². Zero if the camera has no ray there.
  Eigen::Vector3f at(int u, int v, const Eigen::Vector2f& within = {0.5f, 0.5f}) const;
  int width() const { return across_ - 1; }
  int height() const { return static_cast<int>(corners_.size()) / across_ - 1; }
  /// Of the ray through the pixel's centre to the camera's axis: z of at().
  float cosine(int u, int v) const {
    return cosines_[static_cast<std::size_t>(v) * static_cast<std::size_t>(across_ - 1) + static_cast<std::size_t>(u)];
  }

 private:
  int across_;
  std::vector<Eigen::Vector3f> corners_;  ///< unit; NaN if there is no ray
  std::vector<float> cosines_;            ///< by pixel
};

}  // namespace lumigraft::relight
