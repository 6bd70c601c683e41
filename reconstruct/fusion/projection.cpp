#include "reconstruct/fusion/projection.h"

#include <algorithm>

namespace lumigraft::reconstruct {

PixelMap::PixelMap(const capture::CameraModel& camera)
    : fx_(static_cast<float>(camera.fx)),
      fy_(static_cast<float>(camera.fy)),
      cx_(static_cast<float>(camera.cx)),
      cy_(static_cast<float>(camera.cy)),
      width_(camera.width + 2 * kMargin),
      height_(camera.height + 2 * kMargin) {
  if (std::all_of(camera.distortion.begin(), camera.distortion.end(), [](double k) { return k == 0; })) return;
  constexpr float kNowhere = -1e6f;
  table_.reserve(static_cast<std::size_t>(width_) * height_);
  for (int v = -kMargin; v < camera.height + kMargin; ++v)
    for (int u = -kMargin; u < camera.width + kMargin; ++u) {
      const auto pixel = camera.project({(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1});
      table_.push_back(pixel ? Eigen::Vector2f(pixel->cast<float>()) : Eigen::Vector2f(kNowhere, kNowhere));
    }
}

Eigen::Vector2f PixelMap::distorted(float u, float v) const {
  const float a = u + kMargin, b = v + kMargin;
  if (!(a >= 0 && b >= 0 && a < static_cast<float>(width_ - 1) && b < static_cast<float>(height_ - 1)))
    return {-1e6f, -1e6f};
  const int i = static_cast<int>(a), j = static_cast<int>(b);
  const float s = a - static_cast<float>(i), t = b - static_cast<float>(j);
  const Eigen::Vector2f* corner = &table_[static_cast<std::size_t>(j) * width_ + i];
  return (1 - t) * ((1 - s) * corner[0] + s * corner[1]) + t * ((1 - s) * corner[width_] + s * corner[width_ + 1]);
}

}  // namespace lumigraft::reconstruct
