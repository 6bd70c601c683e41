#pragma once
// Signed distance of pixels from the outline of a mask, where it is near: the mattes need no other.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace lumigraft::relight {

class OutlineDistance {
 public:
  /// `front`: not 0 on one side of the outline. Distances up to `reach_px` are exact.
  OutlineDistance(const cv::Mat1b& front, int reach_px);

  /// From the outline, which is half a pixel from the nearest centre of the other side, pixels; negative in front.
  /// Beyond the reach: farther than that.
  float at(int x, int y) const {
    const float px = roots_[static_cast<std::size_t>(squares_[index(x, y)])] - 0.5f;
    return front_(y, x) ? -px : px;
  }
  cv::Size size() const { return front_.size(); }

  /// Calls act(x, distance) for each pixel of a row that is within the reach of the outline.
  template <typename Act>
  void for_each_near(int y, Act act) const {
    const auto reach_px = static_cast<float>(reach_px_);
    for (int left = 0; left < front_.cols; left += kLanes) {
      if (!any_near(left, y)) continue;
      for (int x = left; x < std::min(left + kLanes, front_.cols); ++x) {
        const float px = at(x, y);
        if (std::abs(px) <= reach_px) act(x, px);
      }
    }
  }

 private:
  static constexpr int kLanes = 8;  ///< pixels that are looked at as one

  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * stride_ + static_cast<std::size_t>(x); }
  /// Whether any of the pixels from (left, y) on may be.
  bool any_near(int left, int y) const;

  cv::Mat1b front_;
  int reach_px_;
  std::size_t stride_;  ///< whole lanes
  std::int16_t beyond_;
  std::vector<float> roots_;           ///< by squared distance
  std::vector<std::int16_t> squares_;  ///< of distances to the nearest pixel of the other side, at most `beyond_`
};

}  // namespace lumigraft::relight
