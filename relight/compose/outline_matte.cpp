#include "relight/compose/outline_matte.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "relight/compose/parameters.h"

namespace lumigraft::relight {
namespace {

/// Colours of one side of the outline near a pixel.
struct ColorsOfSide {
  float weight = 0;
  Rgb sum = Rgb::Zero(), sum_of_squares = Rgb::Zero(), values = Rgb::Zero();

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

/// How surely a pixel shows one side alone, by its distance from the outline over sigma: half a pixel inside a finger
/// counts only where nothing else does.
float certainty(float away) {
  const float sure = std::min(0.5f * std::abs(away), 1.0f);
  return sure * sure * sure;
}

}  // namespace

MatteReach::MatteReach(int width)
    : sigma_px(kCompose.matte_sigma_px * std::max(static_cast<float>(width) / 320, 1.0f)),
      matte_px(static_cast<int>(std::ceil(kCompose.matte_reach * sigma_px))),
      samples_px(static_cast<int>(std::ceil((kCompose.matte_reach + kCompose.matte_samples) * sigma_px))) {}

OutlineMatte::OutlineMatte(const DisplacedDepth& depth, const CameraUpload& picture, const cv::Point& corner,
                           const cv::Mat1b& front)
    : depth_(depth), picture_(picture), width_(picture.coded()->width), reach_(width_), corner_(corner), front_(front) {
  cv::distanceTransform(front_, inside_, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::distanceTransform(front_ == 0, outside_, cv::DIST_L2, cv::DIST_MASK_PRECISE);
}

bool OutlineMatte::reaches(int u, int v) const {
  const float away_px = std::abs(signed_px(u - corner_.x, v - corner_.y));
  return away_px <= static_cast<float>(depth_.at(u, v) > 0 ? reach_.matte_px : reach_.samples_px);
}

OutlineMatte::Mixture OutlineMatte::at(int u, int v, const capture::Image<float>* values) const {
  const int x = u - corner_.x, y = v - corner_.y;
  const Rgb own = color(u, v);
  const bool unknown = !(depth_.at(u, v) > 0);
  const float outside_px = signed_px(x, y), sigma_px = reach_.sigma_px;
  if (!unknown && outside_px < -static_cast<float>(reach_.matte_px)) return {1, own, own, own, false, true};
  const float prior = unknown ? 0.5f : normal_cdf(-outside_px / sigma_px);
  // Every other pixel of fine images is enough.
  const int reach_px = reach_.samples_px, step = std::max(static_cast<int>(std::lround(sigma_px)), 1);
  ColorsOfSide front, behind;
  for (int j = y - reach_px; j <= y + reach_px; j += step) {
    if (j < 0 || j >= front_.rows) continue;
    for (int i = x - reach_px; i <= x + reach_px; i += step) {
      if (i < 0 || i >= front_.cols || !(depth_.at(i + corner_.x, j + corner_.y) > 0)) continue;
      const float away_px = signed_px(i, j), sure = certainty(away_px / sigma_px);
      const auto far2 = static_cast<float>((i - x) * (i - x) + (j - y) * (j - y));
      const float spread = 0.5f * static_cast<float>(reach_px), near = 1 / (1 + far2 / (spread * spread)),
                  w = sure * near * near;
      ColorsOfSide& side = away_px < 0 ? front : behind;
      side.add(color(i + corner_.x, j + corner_.y), w);
      if (!values) continue;
      const auto pixel = static_cast<std::size_t>((j + corner_.y) * width_ + i + corner_.x);
      side.values += w * radiance_at(*values, pixel);
    }
  }
  if (!(front.weight > 0) || !(behind.weight > 0)) return {prior, own, own, own, false, outside_px < 0};
  const Rgb apart = front.mean() - behind.mean();
  // The precision of α by colour, channels being independent, and by depth.
  const Rgb noise = prior * front.variance() + (1 - prior) * behind.variance() +
                    kCompose.matte_noise * kCompose.matte_noise * own.square();
  const Rgb precision = apart.square() / noise.max(std::numeric_limits<float>::min());
  const float by_color = precision.sum();
  const float by_depth = 1 / std::max(prior * (1 - prior), 1e-4f);
  const float sum = (precision * (own - behind.mean()) / (apart.abs() > 0).select(apart, Rgb::Ones())).sum();
  const float alpha = std::clamp((sum + by_depth * prior) / (by_color + by_depth), 0.0f, 1.0f);
  return {alpha,
          own,
          front.mean(),
          behind.mean(),
          true,
          outside_px < 0,
          front.values / front.weight,
          behind.values / behind.weight};
}

}  // namespace lumigraft::relight
