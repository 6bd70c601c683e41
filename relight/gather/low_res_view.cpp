#include "relight/gather/low_res_view.h"

#include <algorithm>
#include <cmath>

#include "relight/gather/parameters.h"
#include "relight/tracing/fast_exp.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

float alike_blocks(const SurfaceHit& a, const GBufferPixel& b, float block_m) {
  const float turn = std::max(a.normal.dot(b.surface.normal), 0.0f);
  const float off = a.normal.dot(b.surface.position_m - a.position_m) / (kGather.block_off_plane * block_m);
  return pow32(turn) * fast_exp(off * off);
}

}  // namespace

LowResView::LowResView(const std::vector<GBufferPixel>& seen, const capture::CameraModel& camera, int block)
    : block_(block), camera_(camera) {
  camera_.width = (camera.width + block - 1) / block;
  camera_.height = (camera.height + block - 1) / block;
  camera_.fx /= block;
  camera_.fy /= block;
  right_ = camera_.width > 1 ? 1 : 0;
  below_ = camera_.height > 1 ? static_cast<std::size_t>(camera_.width) : 0;
  seen_.resize(static_cast<std::size_t>(camera_.width) * static_cast<std::size_t>(camera_.height));
  for_each_pixel(camera_.width, camera_.height, kRows, [&](int x, int y) {
    const int pixel =
        central_pixel(seen, camera, block, x, y, [](const GBufferPixel& p) { return p.known && !p.glossy; });
    if (pixel >= 0) seen_[static_cast<std::size_t>(y * camera_.width + x)] = seen[static_cast<std::size_t>(pixel)];
  });
  even_.resize(seen_.size());
  for_each_index(even_.size(), kRows * camera_.width, [&](std::size_t i) { even_[i] = is_even(i); });
}

bool LowResView::is_even(std::size_t first) const {
  const GBufferPixel& own = seen_[first];
  if (!own.known) return false;
  for (std::size_t other : {first, first + right_, first + below_, first + right_ + below_}) {
    if (other >= seen_.size() || !seen_[other].known) return false;
    if (alike_blocks(own.surface, seen_[other], block_m(own)) < kGather.block_alike) return false;
  }
  return true;
}

BlockMix LowResView::mix(int u, int v, const SurfaceHit& surface) const {
  const auto to_middle = static_cast<float>(central_offset(block_));  // where most blocks have their surface
  const float x = (static_cast<float>(u) - to_middle) / static_cast<float>(block_),
              y = (static_cast<float>(v) - to_middle) / static_cast<float>(block_);
  const int left = std::clamp(static_cast<int>(std::floor(x)), 0, std::max(camera_.width - 2, 0)),
            top = std::clamp(static_cast<int>(std::floor(y)), 0, std::max(camera_.height - 2, 0));
  const float right_weight = std::clamp(x - static_cast<float>(left), 0.0f, 1.0f),
              bottom_weight = std::clamp(y - static_cast<float>(top), 0.0f, 1.0f);
  BlockMix mix;
  mix.first = top * camera_.width + left;
  std::array<float, 4> weight{};
  float sum = 0;
  const auto first = static_cast<std::size_t>(mix.first);
  // If the four blocks and the pixel are in one plane, they are all alike.
  const bool even = even_[first] && alike_blocks(surface, seen_[first], block_m(seen_[first])) > kGather.block_alike;
  for (std::size_t k = 0; k < 4; ++k) {
    const GBufferPixel& other = seen_[first + (k & 1 ? right_ : 0) + (k >> 1 ? below_ : 0)];
    if (!other.known) continue;
    const float bilinear = (k & 1 ? right_weight : 1 - right_weight) * (k >> 1 ? bottom_weight : 1 - bottom_weight);
    weight[k] = even ? bilinear
                     : (bilinear + kGather.block_unlike) *
                           (alike_blocks(surface, other, block_m(other)) + kGather.block_unlike);
    sum += weight[k];
  }
  if (!(sum > 0)) return mix;
  // Rounded such that the sum is 255.
  int left_over = 255;
  for (std::size_t k = 0; k < 4; ++k) {
    mix.weight[k] = static_cast<std::uint8_t>(255 * weight[k] / sum);
    left_over -= mix.weight[k];
  }
  const auto largest = std::max_element(mix.weight.begin(), mix.weight.end());
  *largest = static_cast<std::uint8_t>(*largest + left_over);
  return mix;
}

}  // namespace lumigraft::relight
