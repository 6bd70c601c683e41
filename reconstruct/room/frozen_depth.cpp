#include "reconstruct/room/frozen_depth.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "reconstruct/room/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using capture::Image;
constexpr const RoomParameters::FrozenDepth& kFrozen = kRoomParameters.frozen_depth;

/// Green at half the resolution; in proportion to pixel values or to the root of radiance.
Image<float> half_size(const capture::Frame& picture) {
  const bool coded = !picture.encoded.empty();
  const int width = coded ? picture.encoded.width : picture.radiance.width,
            height = coded ? picture.encoded.height : picture.radiance.height;
  const auto value = [&](int u, int v) {
    return coded ? static_cast<float>(picture.encoded.at(u, v, 1))
                 : std::sqrt(std::max(picture.radiance.at(u, v, 1), 0.0f));
  };
  Image<float> half(width / 2, height / 2, 1);
  for (int v = 0; v < half.height; ++v)
    for (int u = 0; u < half.width; ++u)
      half.at(u, v) =
          value(2 * u, 2 * v) + value(2 * u + 1, 2 * v) + value(2 * u, 2 * v + 1) + value(2 * u + 1, 2 * v + 1);
  return half;
}

/// Correlation of two pictures in a block; NaN where the first has no texture.
float correlation(const Image<float>& a, const Image<float>& b, int left, int top) {
  double sum_a = 0, sum_b = 0, aa = 0, bb = 0, ab = 0;
  for (int v = top; v < top + kFrozen.block_px; ++v) {
    for (int u = left; u < left + kFrozen.block_px; ++u) {
      const double x = a.at(u, v), y = b.at(u, v);
      sum_a += x;
      sum_b += y;
      aa += x * x;
      bb += y * y;
      ab += x * y;
    }
  }
  constexpr double kPixels = kFrozen.block_px * kFrozen.block_px;
  const double variance_a = aa / kPixels - std::pow(sum_a / kPixels, 2),
               variance_b = bb / kPixels - std::pow(sum_b / kPixels, 2);
  if (!(variance_a > std::pow(kFrozen.min_contrast * sum_a / kPixels, 2))) return NAN;
  if (!(variance_b > 0)) return 0;
  return static_cast<float>((ab / kPixels - sum_a * sum_b / kPixels / kPixels) / std::sqrt(variance_a * variance_b));
}

float median(std::vector<float> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Whether most parts of the picture that have texture show another one: the camera moved, and not a hand or a tag.
/// Light that changes leaves the texture.
bool moved(const Image<float>& before, const Image<float>& now) {
  if (before.width != now.width || before.height != now.height) return true;
  std::vector<float> of_parts;
  for (int part = 0; part < kFrozen.columns * kFrozen.rows; ++part) {
    const int left = part % kFrozen.columns * now.width / kFrozen.columns,
              right = (part % kFrozen.columns + 1) * now.width / kFrozen.columns,
              top = part / kFrozen.columns * now.height / kFrozen.rows,
              bottom = (part / kFrozen.columns + 1) * now.height / kFrozen.rows;
    std::vector<float> of_blocks;
    for (int v = top; v + kFrozen.block_px <= bottom; v += kFrozen.block_px)
      for (int u = left; u + kFrozen.block_px <= right; u += kFrozen.block_px)
        if (const float found = correlation(before, now, u, v); !std::isnan(found)) of_blocks.push_back(found);
    if (!of_blocks.empty()) of_parts.push_back(median(std::move(of_blocks)));
  }
  return of_parts.size() >= kFrozen.min_parts && median(std::move(of_parts)) < kFrozen.min_correlation;
}

}  // namespace

capture::FrameSet FrozenDepth::check(const capture::FrameSet& frame) {
  capture::FrameSet checked = frame;
  if (!frame.depth || !frame.color) return checked;
  const Image<float>& depth_m = frame.depth->depth_m;
  const bool equal = depth_ && depth_->depth_m.width == depth_m.width && depth_->depth_m.height == depth_m.height &&
                     depth_->depth_m.data == depth_m.data;
  if (!equal) {
    depth_ = frame.depth;
    seen_with_it_ = half_size(*frame.color);
    frozen_ = false;
    return checked;
  }
  // A slower depth camera's newest picture belongs to more than one colour frame.
  if (frame.depth->stamp.time_ns == depth_->stamp.time_ns) return checked;
  frozen_ = moved(seen_with_it_, half_size(*frame.color));
  if (frozen_) {
    checked.depth = nullptr;
    checked.raw_depth = nullptr;
  }
  return checked;
}

std::vector<std::string> FrozenDepth::warnings() const {
  if (!frozen_) return {};
  return {"depth: the camera repeats one picture while it moves; it is not used until the next"};
}

}  // namespace lumigraft::reconstruct
