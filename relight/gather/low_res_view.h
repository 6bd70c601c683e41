#pragma once
// A view at reduced resolution: one pixel represents each block of the image, and every full-size pixel interpolates
// the surrounding blocks that show the same surface (Kopf et al. 2007, joint bilateral upsampling).
#include <array>
#include <cstdint>

#include "relight/gather/gbuffer.h"

namespace lumigraft::relight {

/// A pixel's weights of the four blocks around it, in 255ths; empty if no block shows its surface.
struct BlockMix {
  std::int32_t first = 0;  ///< index of the upper left block
  std::array<std::uint8_t, 4> weight{};

  bool empty() const { return weight == std::array<std::uint8_t, 4>{}; }
};

class LowResView {
 public:
  /// `block`: their edge, pixels. Glossy surfaces are excluded.
  LowResView(const std::vector<GBufferPixel>& seen, const capture::CameraModel& camera, int block);

  /// Per block, laid out as the pixels of an image of that size; `camera` is the matching camera.
  const std::vector<GBufferPixel>& seen() const { return seen_; }
  const capture::CameraModel& camera() const { return camera_; }

  /// For a surface visible at a pixel of the full-size image.
  BlockMix mix(int u, int v, const SurfaceHit& surface) const;

  /// `value(block)`, interpolated; zero for an empty mix.
  template <typename Value>
  auto mixed(const BlockMix& mix, Value value) const -> decltype(value(std::size_t{})) {
    const auto first = static_cast<std::size_t>(mix.first);
    return mix.weight[0] / 255.0f * value(first) + mix.weight[1] / 255.0f * value(first + right_) +
           mix.weight[2] / 255.0f * value(first + below_) + mix.weight[3] / 255.0f * value(first + right_ + below_);
  }

 private:
  float block_m(const GBufferPixel& p) const { return p.depth_m / static_cast<float>(camera_.fx); }
  bool is_even(std::size_t first) const;

  int block_;
  capture::CameraModel camera_;  ///< only its size and focal lengths are valid
  std::size_t right_, below_;    ///< offset from a block to its right and lower neighbour, 0 if there is none
  std::vector<GBufferPixel> seen_;
  std::vector<std::uint8_t> even_;  ///< per block: it and its right and lower neighbours show one plane
};

}  // namespace lumigraft::relight
