#include "capture/camera/srgb.h"

#include <cmath>
#include <limits>

namespace lumigraft::capture {

float srgb_to_linear(float encoded) {
  return encoded <= 0.04045f ? encoded / 12.92f : std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}

float linear_to_srgb(float linear) {
  if (!(linear > 0.0f)) return 0.0f;
  return linear >= 1.0f         ? 1.0f
         : linear <= 0.0031308f ? 12.92f * linear
                                : 1.055f * std::pow(linear, 1.0f / 2.4f) - 0.055f;
}

SrgbTable::SrgbTable() {
  for (std::size_t code = 0; code < 256; ++code) linear[code] = srgb_to_linear(static_cast<float>(code) / 255.0f);
  from_.front() = 0;
  from_.back() = std::numeric_limits<float>::infinity();
  for (int code = 1; code < 256; ++code) {
    float below = 0, at = 1;
    for (float middle = 0.5f; middle > below && middle < at; middle = below + 0.5f * (at - below)) {
      (std::lround(255 * linear_to_srgb(middle)) >= code ? at : below) = middle;
    }
    from_[static_cast<std::size_t>(code)] = at;
  }
  std::size_t code = 0;
  for (std::size_t step = 0; step < at_least_.size(); ++step) {
    while (static_cast<float>(step) / kSteps >= from_[code + 1]) ++code;
    at_least_[step] = static_cast<std::uint8_t>(code);
  }
}

}  // namespace lumigraft::capture
