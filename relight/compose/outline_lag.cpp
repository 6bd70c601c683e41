#include "relight/compose/outline_lag.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "relight/compose/parameters.h"

namespace lumigraft::relight {
namespace {

using Eigen::Array3f;
using Eigen::Vector2f;

/// Where the colour changes near a point of the outline.
struct Step {
  Vector2f normal = Vector2f::Zero();  ///< out of the foreground
  float at_px = 0;                     ///< along it
};

class Profiles {
 public:
  Profiles(const capture::Image<std::uint8_t>& picture, const cv::Point& corner, const cv::Mat1b& front, int reach_px)
      : picture_(picture), corner_(corner), reach_px_(reach_px) {
    cv::Mat1f inside;
    cv::distanceTransform(front, inside, cv::DIST_L2, cv::DIST_MASK_5);
    cv::distanceTransform(front == 0, away_, cv::DIST_L2, cv::DIST_MASK_5);
    away_ -= inside;
  }

  std::vector<Step> steps() const {
    std::vector<std::array<int, 2>> outline;
    for (int y = 1; y + 1 < away_.rows; ++y) {
      for (int x = 1; x + 1 < away_.cols; ++x) {
        if (away_(y, x) < 0 && away_(y, x) > -1.3f) outline.push_back({x, y});
      }
    }
    const std::size_t stride = outline.size() / kCompose.lag_points + 1;
    std::vector<Step> steps;
    for (std::size_t k = 0; k < outline.size(); k += stride) add_step(outline[k][0], outline[k][1], steps);
    return steps;
  }

 private:
  bool color(const Vector2f& at, Array3f& color) const {
    const auto u = static_cast<int>(std::lround(at.x())) + corner_.x,
               v = static_cast<int>(std::lround(at.y())) + corner_.y;
    if (u < 0 || v < 0 || u >= picture_.width || v >= picture_.height) return false;
    const std::uint8_t* code = &picture_.data[picture_.index(u, v)];
    color = {static_cast<float>(code[0]), static_cast<float>(code[1]), static_cast<float>(code[2])};
    return true;
  }
  /// Signed distance in the window; NaN outside it.
  float away_px(const Vector2f& at) const {
    const auto x = static_cast<int>(std::lround(at.x())), y = static_cast<int>(std::lround(at.y()));
    const bool inside = x >= 0 && y >= 0 && x < away_.cols && y < away_.rows;
    return inside ? away_(y, x) : std::numeric_limits<float>::quiet_NaN();
  }

  void add_step(int x, int y, std::vector<Step>& steps) const {
    const Vector2f slope(away_(y, x + 1) - away_(y, x - 1), away_(y + 1, x) - away_(y - 1, x));
    if (!(slope.norm() > 0.5f)) return;
    const Vector2f n = slope.normalized(), p(static_cast<float>(x), static_cast<float>(y));
    const auto far_px = static_cast<float>(reach_px_ + 2);
    // Both sides must be wide enough for colours that the displacement does not reach.
    if (!(away_px(p - far_px * n) < -0.7f * far_px) || !(away_px(p + far_px * n) > 0.7f * far_px)) return;
    Array3f front, behind;
    if (!color(p - far_px * n, front) || !color(p + far_px * n, behind)) return;
    const float contrast2 = (front - behind).square().sum();
    if (contrast2 < kCompose.lag_contrast * kCompose.lag_contrast) return;
    // The cost of a step at t is that of `behind` below it and of `front` above.
    float best = 0, cost = 0, best_px = static_cast<float>(-reach_px_) - 0.5f, all = 0;
    for (int t = -reach_px_; t <= reach_px_; ++t) {
      Array3f own;
      if (!color(p + static_cast<float>(t) * n, own)) return;
      const float as_front = (own - front).square().sum(), as_behind = (own - behind).square().sum();
      cost += std::min(as_front, contrast2) - std::min(as_behind, contrast2);
      all += std::min({as_front, as_behind, contrast2});
      if (cost < best) {
        best = cost;
        best_px = static_cast<float>(t) + 0.5f;
      }
    }
    if (all > 0.2f * contrast2 * static_cast<float>(2 * reach_px_ + 1)) return;  // neither colour explains it
    steps.push_back({n, best_px - 0.5f});  // the outline is half a pixel from the pixel's centre
  }

  const capture::Image<std::uint8_t>& picture_;
  cv::Point corner_;
  int reach_px_;
  cv::Mat1f away_;  ///< signed distance from the outline, pixels
};

/// Geman and McClure 1987.
float robust(float off) { return off * off / (1 + off * off); }

}  // namespace

cv::Point outline_displacement(const capture::Image<std::uint8_t>& picture, const cv::Point& corner,
                               const cv::Mat1b& front) {
  const float scale = std::max(static_cast<float>(picture.width) / 320, 1.0f);
  const auto reach_px = static_cast<int>(std::lround(kCompose.lag_px * scale));
  const std::vector<Step> steps = Profiles(picture, corner, front, reach_px).steps();
  if (steps.size() < kCompose.lag_min_steps) return {0, 0};
  const auto cost = [&](const Vector2f& by) {
    float sum = 0;
    for (const Step& s : steps) sum += robust((s.at_px - by.dot(s.normal)) / scale);
    return sum;
  };
  // The best of all, whole pixels: the robust cost has several minima.
  const float at_rest = cost(Vector2f::Zero());
  float least = kCompose.lag_gain * at_rest;
  cv::Point best{0, 0};
  const auto search = [&](const cv::Point& around, int reach, int step) {
    for (int y = around.y - reach; y <= around.y + reach; y += step) {
      for (int x = around.x - reach; x <= around.x + reach; x += step) {
        const float there = cost(Vector2f(static_cast<float>(x), static_cast<float>(y)));
        if (!(there < least)) continue;
        least = there;
        best = {x, y};
      }
    }
  };
  const auto step = static_cast<int>(scale);
  search({0, 0}, reach_px, step);
  if (step > 1 && best != cv::Point()) search(best, step - 1, 1);
  return best;
}

}  // namespace lumigraft::relight
