#pragma once
// Converts linear light to 8-bit sRGB by table, with exactly the rounding of linear_to_srgb.
#include <array>
#include <cstdint>

namespace lumigraft::relight {

class SrgbCodes {
 public:
  SrgbCodes();
  /// linear_to_srgb(linear) in 255ths, rounded.
  std::uint8_t operator()(float linear) const {
    if (!(linear > 0)) return 0;
    if (linear >= 1) return 255;
    std::uint32_t code = at_least_[static_cast<std::size_t>(linear * kSteps)];
    while (linear >= from_[code + 1]) ++code;
    return static_cast<std::uint8_t>(code);
  }

 private:
  static constexpr float kSteps = 4096;
  std::array<float, 257> from_;                                          ///< lower bound of each pixel value
  std::array<std::uint8_t, static_cast<std::size_t>(kSteps)> at_least_;  ///< pixel value at the start of each step
};

}  // namespace lumigraft::relight
