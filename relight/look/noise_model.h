#pragma once
// What a camera's noise looks like, in pixel values (sRGB): its variance by level, and a sample of it with its
// correlation between pixels and channels.
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace lumigraft::relight {

/// Noise of unit variance in every channel, periodic in both directions.
struct NoiseTile {
  static constexpr int kEdge = 128;                                                ///< pixels; a power of two
  std::vector<float> values = std::vector<float>(std::size_t{3} * kEdge * kEdge);  ///< row-major, R G B

  const float* at(int u, int v) const {
    return &values[std::size_t{3} * static_cast<std::size_t>((v & (kEdge - 1)) * kEdge + (u & (kEdge - 1)))];
  }
};

struct NoiseModel {
  /// By channel and pixel value; squared pixel values, without that of rounding to whole ones. 0 at 255, where a camera
  /// clips.
  std::array<std::array<float, 256>, 3> variance{};
  std::shared_ptr<const NoiseTile> tile;
};

}  // namespace lumigraft::relight
