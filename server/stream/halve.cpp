#include "server/stream/halve.h"

#include <algorithm>

namespace lumigraft::server {

capture::Image<std::uint8_t> halved(const capture::Image<std::uint8_t>& srgb) {
  capture::Image<std::uint8_t> half(std::max(srgb.width / 2, 1), std::max(srgb.height / 2, 1), srgb.channels);
  const int right = srgb.width > 1 ? 1 : 0, below = srgb.height > 1 ? 1 : 0;
  for (int y = 0; y < half.height; ++y) {
    for (int x = 0; x < half.width; ++x) {
      for (int c = 0; c < srgb.channels; ++c) {
        const int sum = srgb.at(2 * x, 2 * y, c) + srgb.at(2 * x + right, 2 * y, c) + srgb.at(2 * x, 2 * y + below, c) +
                        srgb.at(2 * x + right, 2 * y + below, c);
        half.at(x, y, c) = static_cast<std::uint8_t>((sum + 2) / 4);
      }
    }
  }
  return half;
}

}  // namespace lumigraft::server
