#include "relight/gather/srgb_codes.h"

#include <cmath>
#include <limits>

#include "capture/camera/response.h"

namespace lumigraft::relight {

SrgbCodes::SrgbCodes() {
  from_.front() = 0;
  from_.back() = std::numeric_limits<float>::infinity();
  for (int code = 1; code < 256; ++code) {
    float below = 0, at = 1;
    for (float middle = 0.5f; middle > below && middle < at; middle = below + 0.5f * (at - below)) {
      (std::lround(255 * capture::linear_to_srgb(middle)) >= code ? at : below) = middle;
    }
    from_[static_cast<std::size_t>(code)] = at;
  }
  std::size_t code = 0;
  for (std::size_t step = 0; step < at_least_.size(); ++step) {
    while (static_cast<float>(step) / kSteps >= from_[code + 1]) ++code;
    at_least_[step] = static_cast<std::uint8_t>(code);
  }
}

}  // namespace lumigraft::relight
