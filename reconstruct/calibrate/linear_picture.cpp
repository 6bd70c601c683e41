#include "reconstruct/calibrate/linear_picture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "capture/camera/radiance.h"
#include "reconstruct/pose/gray_regions.h"

namespace lumigraft::reconstruct {
namespace {

constexpr std::array<float, 3> kLuminance = {0.2126f, 0.7152f, 0.0722f};  // Rec. 709

}  // namespace

capture::Image<std::uint16_t> linear_light(const capture::Frame& picture, const capture::Response& response) {
  const bool encoded = !picture.encoded.empty();
  capture::Image<std::uint16_t> light(encoded ? picture.encoded.width : picture.radiance.width,
                                      encoded ? picture.encoded.height : picture.radiance.height, 1);
  const float gain = encoded ? 1.0f : detector_gain(picture.radiance);
  for (std::size_t i = 0; i < light.data.size(); ++i) {
    float sum = 0;
    bool cut = false;
    for (int c = 0; c < 3; ++c) {
      const std::size_t at = 3 * i + static_cast<std::size_t>(c);
      const float channel = encoded ? response.to_linear(std::min(picture.encoded.data[at], capture::kFullScale), c)
                                    : gain * picture.radiance.data[at];
      sum += kLuminance[static_cast<std::size_t>(c)] * channel;
      cut = cut || (encoded && picture.encoded.data[at] >= capture::kFullScale);
    }
    cut = cut || sum > 1.0f;
    const auto halves = static_cast<std::uint16_t>(std::lround(32767.0f * std::clamp(sum, 0.0f, 1.0f)));
    light.data[i] = static_cast<std::uint16_t>(2 * halves + (cut ? 1 : 0));
  }
  return light;
}

}  // namespace lumigraft::reconstruct
