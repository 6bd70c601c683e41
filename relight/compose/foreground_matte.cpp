#include "relight/compose/foreground_matte.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "relight/compose/parameters.h"
#include "relight/compose/rgb_image.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

/// Colours of one side of the outline near a pixel.
struct Side {
  float weight = 0;
  Rgb sum = Rgb::Zero(), sum_of_squares = Rgb::Zero();

  void add(const Rgb& color, float w) {
    weight += w;
    sum += w * color;
    sum_of_squares += w * color.square();
  }
  Rgb mean() const { return sum / weight; }
  Rgb variance() const { return (sum_of_squares / weight - mean().square()).max(0); }
};

/// Fraction of a Gaussian below x.
float normal_cdf(float x) { return 0.5f * std::erfc(-x / std::sqrt(2.0f)); }

/// Bounds of the pixels that have an object, in the image.
cv::Rect bounds_of(const ObjectLayer& objects) {
  const capture::Image<float>& distance_m = objects.distance_m;
  int left = distance_m.width, right = -1, top = distance_m.height, bottom = -1;
  for (int y = 0; y < distance_m.height; ++y) {
    const float* row = &distance_m.data[distance_m.index(0, y)];
    const auto any = [](float m) { return m > 0; };
    const auto first = static_cast<int>(std::find_if(row, row + distance_m.width, any) - row);
    if (first == distance_m.width) continue;
    int last = distance_m.width - 1;
    while (!any(row[last])) --last;
    left = std::min(left, first);
    right = std::max(right, last);
    top = std::min(top, y);
    bottom = y;
  }
  return right < 0 ? cv::Rect() : cv::Rect(left + objects.left, top + objects.top, right + 1 - left, bottom + 1 - top);
}

/// The window of the objects, with a margin; images of it.
class Outline {
 public:
  /// `bounds`: of the objects, not empty.
  Outline(const CurrentDepth& depth, const CameraUpload& picture, const ObjectLayer& objects, const cv::Rect& bounds)
      : depth_(depth),
        picture_(picture),
        width_(picture.coded()->width),
        sigma_px_(kCompose.matte_sigma_px * std::max(static_cast<float>(width_) / 320, 1.0f)),
        reach_px_(static_cast<int>(std::ceil(kCompose.matte_reach * sigma_px_))),
        samples_px_(static_cast<int>(std::ceil((kCompose.matte_reach + kCompose.matte_samples) * sigma_px_))),
        left_(std::max(bounds.x - samples_px_, 0)),
        top_(std::max(bounds.y - samples_px_, 0)),
        front_(std::min(bounds.y + bounds.height + samples_px_, picture.coded()->height) - top_,
               std::min(bounds.x + bounds.width + samples_px_, width_) - left_, std::uint8_t{0}) {
    find_front(objects, bounds);
  }

  bool any() const { return any_; }
  /// Whether pixel (u, v) of the image is within reach of a surface in front of the objects.
  bool concerns(int u, int v) const {
    return from_core_(v - top_, u - left_) <= static_cast<float>(depth_.at(u, v) > 0 ? reach_px_ : samples_px_);
  }

  struct Mixture {
    float foreground;  ///< α
    Rgb own, behind;   ///< the colours of the pixel, and of what the object replaces
  };
  Mixture at(int u, int v) const {
    const int x = u - left_, y = v - top_;
    const Rgb own = color(u, v);
    const bool unknown = !(depth_.at(u, v) > 0);
    const float outside_px = signed_px(x, y);
    if (!unknown && outside_px < -static_cast<float>(reach_px_)) return {1, own, own};
    const float prior = unknown ? 0.5f : normal_cdf(-outside_px / sigma_px_);
    Side front, behind;
    for (int j = std::max(y - samples_px_, 0); j <= std::min(y + samples_px_, front_.rows - 1); ++j) {
      for (int i = std::max(x - samples_px_, 0); i <= std::min(x + samples_px_, front_.cols - 1); ++i) {
        const float away_px = signed_px(i, j);
        if (std::abs(away_px) < 2 * sigma_px_ || !(depth_.at(i + left_, j + top_) > 0)) continue;
        const auto far2 = static_cast<float>((i - x) * (i - x) + (j - y) * (j - y));
        const float spread = 0.5f * static_cast<float>(samples_px_);
        (away_px < 0 ? front : behind).add(color(i + left_, j + top_), std::exp(-0.5f * far2 / (spread * spread)));
      }
    }
    if (!(front.weight > 0) || !(behind.weight > 0)) return {prior, own, own};
    const Rgb apart = front.mean() - behind.mean();
    // The precision of α by colour, channels being independent, and by depth.
    const Rgb noise = prior * front.variance() + (1 - prior) * behind.variance() +
                      kCompose.matte_noise * kCompose.matte_noise * own.square();
    const Rgb precision = apart.square() / noise.max(std::numeric_limits<float>::min());
    const float by_color = precision.sum();
    const float by_depth = 1 / std::max(prior * (1 - prior), 1e-4f);
    const float sum = (precision * (own - behind.mean()) / (apart.abs() > 0).select(apart, Rgb::Ones())).sum();
    const float alpha = std::clamp((sum + by_depth * prior) / (by_color + by_depth), 0.0f, 1.0f);
    return {alpha, own, behind.mean()};
  }

 private:
  Rgb color(int u, int v) const { return picture_.radiance(static_cast<std::size_t>(v * width_ + u)); }
  /// Distance from the outline in depth: negative in the foreground.
  float signed_px(int x, int y) const { return front_(y, x) ? 0.5f - inside_(y, x) : outside_(y, x) - 0.5f; }

  void find_front(const ObjectLayer& objects, const cv::Rect& bounds) {
    cv::Mat1b core(front_.size(), std::uint8_t{0});  // in front of an object, at its pixels
    for (int v = bounds.y; v < bounds.y + bounds.height; ++v) {
      for (int u = bounds.x; u < bounds.x + bounds.width; ++u) {
        const float object_m = objects.distance_m.at(u - objects.left, v - objects.top);
        if (!(object_m > 0)) continue;
        const float depth_m = depth_.at(u, v);
        if (!(depth_m > 0) || depth_m >= object_m - depth_.allowed_m(depth_m)) continue;
        core(v - top_, u - left_) = 255;
        any_ = true;
      }
    }
    if (!any_) return;
    // Pixels without an object belong to the foreground if their depth continues that of the nearest core pixel.
    cv::Mat1i nearest;
    cv::distanceTransform(~core, from_core_, nearest, cv::DIST_L2, cv::DIST_MASK_5, cv::DIST_LABEL_PIXEL);
    std::vector<float> core_m(static_cast<std::size_t>(front_.total()) + 1);
    for (int y = 0; y < front_.rows; ++y) {
      for (int x = 0; x < front_.cols; ++x) {
        if (core(y, x)) core_m[static_cast<std::size_t>(nearest(y, x))] = depth_.at(x + left_, y + top_);
      }
    }
    for (int y = 0; y < front_.rows; ++y) {
      for (int x = 0; x < front_.cols; ++x) {
        const float depth_m = depth_.at(x + left_, y + top_), near_m = core_m[static_cast<std::size_t>(nearest(y, x))];
        const int u = x + left_ - objects.left, v = y + top_ - objects.top;
        const bool inside = u >= 0 && v >= 0 && u < objects.coverage.width && v < objects.coverage.height;
        const bool on_object = inside && objects.distance_m.at(u, v) > 0;
        const bool continues = !on_object && depth_m > 0 && depth_m < near_m * (1 + kCompose.moved_jump);
        front_(y, x) = core(y, x) || continues ? 255 : 0;
      }
    }
    cv::distanceTransform(front_, inside_, cv::DIST_L2, cv::DIST_MASK_PRECISE);
    cv::distanceTransform(~front_, outside_, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  }

  const CurrentDepth& depth_;
  const CameraUpload& picture_;
  int width_;
  float sigma_px_;
  int reach_px_, samples_px_, left_, top_;
  cv::Mat1b front_;                         ///< nearer than the objects
  cv::Mat1f inside_, outside_, from_core_;  ///< distances in pixels: from what is not front, from front, from the core
  bool any_ = false;
};

/// Null if nothing is in front.
std::unique_ptr<const Outline> outline_of(const CurrentDepth& depth, const CameraUpload& picture,
                                          const ObjectLayer& objects) {
  const cv::Rect bounds = depth.any() ? bounds_of(objects) : cv::Rect();
  if (bounds.empty()) return nullptr;
  auto outline = std::make_unique<const Outline>(depth, picture, objects, bounds);
  return outline->any() ? std::move(outline) : nullptr;
}

void hide(const Outline& outline, ObjectLayer& objects) {
  for_each_pixel(objects.coverage.width, objects.coverage.height, kRows, [&](int x, int y) {
    const int u = x + objects.left, v = y + objects.top;
    float& coverage = objects.coverage.at(x, y);
    if (!(coverage > 0) || !(objects.distance_m.at(x, y) > 0) || !outline.concerns(u, v)) return;
    const auto [foreground, own, behind] = outline.at(u, v);
    const float kept = 1 - foreground;
    const std::size_t i = objects.coverage.index(x, y);
    coverage *= kept;
    // (1 - coverage) C + coverage (C - B) = C - coverage B: removes the background's part of the mixture.
    set_at(objects.radiance, i, kept * radiance_at(objects.radiance, i) + coverage * (own - behind));
  });
}

}  // namespace

void hide_behind_foreground(const CurrentDepth& depth, const CameraUpload& picture, ObjectLayer& objects) {
  if (const auto outline = outline_of(depth, picture, objects)) hide(*outline, objects);
}

std::optional<ObjectLayer> behind_foreground(const CurrentDepth& depth, const CameraUpload& picture,
                                             const ObjectLayer& objects) {
  const auto outline = outline_of(depth, picture, objects);
  if (!outline) return std::nullopt;
  ObjectLayer hidden = objects;
  hide(*outline, hidden);
  return hidden;
}

}  // namespace lumigraft::relight
