#include "relight/compose/pixel_rays.h"

#include <limits>

namespace lumigraft::relight {

using Eigen::Vector3f;

PixelRays::PixelRays(const capture::CameraModel& camera) : across_(camera.width + 1) {
  corners_.reserve(static_cast<std::size_t>(across_) * static_cast<std::size_t>(camera.height + 1));
  for (int v = 0; v <= camera.height; ++v) {
    for (int u = 0; u <= camera.width; ++u) {
      const auto w = camera.unproject({u - 0.5, v - 0.5});
      corners_.push_back(w ? w->normalized().cast<float>().eval()
                           : Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()).eval());
    }
  }
  cosines_.reserve(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) cosines_.push_back(at(u, v).z());
  }
}

Vector3f PixelRays::at(int u, int v, const Eigen::Vector2f& within) const {
  const Vector3f* top = &corners_[static_cast<std::size_t>(v) * across_ + u];
  const Vector3f* bottom = top + across_;
  const float x = within.x(), y = within.y();
  const Vector3f w = (1 - y) * ((1 - x) * top[0] + x * top[1]) + y * ((1 - x) * bottom[0] + x * bottom[1]);
  const float length = w.norm();
  return length > 0 ? (w / length).eval() : Vector3f::Zero().eval();  // NaN becomes zero too
}

}  // namespace lumigraft::relight
