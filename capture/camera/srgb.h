#pragma once
// The sRGB curve (IEC 61966-2-1) and 8-bit sRGB pixel values by table; on the GPU: relight/shaders/common/srgb.glsl.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace lumigraft::capture {

float srgb_to_linear(float encoded);  ///< both in [0, 1]
float linear_to_srgb(float linear);   ///< inverse, clipped to [0, 1]; of NaN 0

class SrgbTable {
 public:
  SrgbTable();
  std::array<float, 256> linear;  ///< srgb_to_linear(pixel value / 255), by pixel value
  /// lround(255 * linear_to_srgb(light)).
  std::uint8_t code(float light) const {
    // Without branches: light is different in every pixel. A step contains the start of one pixel value at most.
    const float bounded = std::min(light > 0 ? light : 0.0f, 1.0f);
    const unsigned code = at_least_[static_cast<std::size_t>(static_cast<int>(bounded * kSteps))];
    return static_cast<std::uint8_t>(code + static_cast<unsigned>(bounded >= from_[code + 1]));
  }

 private:
  static constexpr float kSteps = 4096;
  std::array<float, 257> from_;                                              ///< lower bound of each pixel value
  std::array<std::uint8_t, static_cast<std::size_t>(kSteps) + 1> at_least_;  ///< pixel value at the start of each step
};

inline const SrgbTable& srgb_table() {
  static const SrgbTable table;
  return table;
}

}  // namespace lumigraft::capture
