#pragma once
// A view of fewer pixels: of each block of the picture one pixel stands for all of it, and every pixel mixes the blocks
// around it that show the same surface (Kopf et al. 2007, joint bilateral upsampling).
#include <array>
#include <cstdint>

#include "relight/gather/gbuffer.h"

namespace lumigraft::relight {

/// What a pixel takes of the four blocks around it, in 255ths; nothing where no block says anything.
struct BlockMix {
  std::int32_t first = 0;  ///< the left upper one
  std::array<std::uint8_t, 4> weight{};

  bool empty() const { return weight == std::array<std::uint8_t, 4>{}; }
};

class LowResView {
 public:
  /// `block`: their edge, pixels. Glossy surfaces are left out.
  LowResView(const std::vector<GBufferPixel>& seen, const capture::CameraModel& camera, int block);

  /// By block, as by pixel of a picture of that size; with the camera that has it.
  const std::vector<GBufferPixel>& seen() const { return seen_; }
  const capture::CameraModel& camera() const { return camera_; }

  /// For a surface that is seen at a pixel of the picture.
  BlockMix mix(int u, int v, const SurfaceHit& surface) const;

  /// `value(block)`, mixed; zero for an empty mix.
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
  capture::CameraModel camera_;  ///< only its size and focal lengths mean something
  std::size_t right_, below_;    ///< from a block to those beside it, 0 where there are none
  std::vector<GBufferPixel> seen_;
  std::vector<std::uint8_t> even_;  ///< by block: it and those right of and below it show one plane
};

}  // namespace lumigraft::relight
