#include "relight/compose/outline_lag.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "relight/compose/parameters.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

using Eigen::Array3f;
using Eigen::Vector2f;

constexpr int kBeyond_px = 2;         // colours of both sides are taken from so far beyond the search
constexpr float kWide = 0.7f;         // of that distance must a side be wide
constexpr float kOutline_px = 0.85f;  // distance of pixels at the outline, those at its corners included

/// Where the colour changes near a point of the outline.
struct Step {
  Vector2f normal = Vector2f::Zero();  ///< out of the foreground
  float at_px = 0;                     ///< along it
};

class Profiles {
 public:
  Profiles(const capture::Image<std::uint8_t>& picture, const cv::Point& corner, const OutlineDistance& away,
           int reach_px)
      : picture_(picture), corner_(corner), away_(away), reach_px_(reach_px) {}

  std::vector<Step> steps() const {
    const cv::Size size = away_.size();
    using Place = std::array<int, 2>;
    const std::vector<Place> outline = found_in_rows<Place>(size.height, [&](int y, std::vector<Place>& found) {
      away_.for_each_near(y, [&](int x, float away_px) {
        const bool within = x > 0 && y > 0 && x + 1 < size.width && y + 1 < size.height;
        if (within && away_px < 0 && away_px > -kOutline_px) found.push_back({x, y});
      });
    });
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
    const bool inside = x >= 0 && y >= 0 && x < away_.size().width && y < away_.size().height;
    return inside ? away_.at(x, y) : std::numeric_limits<float>::quiet_NaN();
  }

  void add_step(int x, int y, std::vector<Step>& steps) const {
    const Vector2f slope(away_.at(x + 1, y) - away_.at(x - 1, y), away_.at(x, y + 1) - away_.at(x, y - 1));
    if (!(slope.norm() > 0.5f)) return;
    const Vector2f n = slope.normalized(), p(static_cast<float>(x), static_cast<float>(y));
    const auto far_px = static_cast<float>(reach_px_ + kBeyond_px);
    // Both sides must be wide enough for colours that the displacement does not reach.
    if (!(away_px(p - far_px * n) < -kWide * far_px) || !(away_px(p + far_px * n) > kWide * far_px)) return;
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
  const OutlineDistance& away_;
  int reach_px_;
};

/// Geman and McClure 1987.
float robust(float off) { return off * off / (1 + off * off); }

float scale_of(int width) { return std::max(static_cast<float>(width) / 320, 1.0f); }

}  // namespace

cv::Mat1f DisplacedDepth::within(const cv::Rect& window) const {
  cv::Mat1f z_m(window.size(), 0.0f);
  const capture::Image<float>& image = depth.along_z_m();
  const cv::Mat1f all(image.height, image.width, const_cast<float*>(image.data.data()));
  const cv::Rect seen = (window - by) & cv::Rect({}, all.size());
  if (!seen.empty()) all(seen).copyTo(z_m(seen + by - window.tl()));
  return z_m;
}

int lag_reach_px(int width) { return static_cast<int>(std::lround(kCompose.lag_px * scale_of(width))); }
int lag_distance_px(int width) {
  return static_cast<int>(std::ceil(kWide * static_cast<float>(lag_reach_px(width) + kBeyond_px)));
}

cv::Point outline_displacement(const capture::Image<std::uint8_t>& picture, const cv::Point& corner,
                               const OutlineDistance& away) {
  const float scale = scale_of(picture.width);
  const int reach_px = lag_reach_px(picture.width);
  const std::vector<Step> steps = Profiles(picture, corner, away, reach_px).steps();
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
