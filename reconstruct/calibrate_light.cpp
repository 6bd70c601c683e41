#include "reconstruct/calibrate_light.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "reconstruct/pose_picture.h"

namespace lumigraft {
namespace {

constexpr std::array<float, 3> kLuminance = {0.2126f, 0.7152f, 0.0722f};  // Rec. 709

}  // namespace

Image<std::uint16_t> linear_light(const Picture& picture, const Response& response) {
  const bool encoded = !picture.encoded.empty();
  Image<std::uint16_t> light(encoded ? picture.encoded.width : picture.radiance.width,
                             encoded ? picture.encoded.height : picture.radiance.height, 1);
  const float gain = encoded ? 1.0f : detector_gain(picture.radiance);
  for (std::size_t i = 0; i < light.data.size(); ++i) {
    float sum = 0;
    for (int c = 0; c < 3; ++c) {
      const std::size_t at = 3 * i + static_cast<std::size_t>(c);
      sum += kLuminance[static_cast<std::size_t>(c)] *
             (encoded ? response.to_linear(picture.encoded.data[at], c) : gain * picture.radiance.data[at]);
    }
    light.data[i] = static_cast<std::uint16_t>(std::lround(65535.0f * std::clamp(sum, 0.0f, 1.0f)));
  }
  return light;
}

}  // namespace lumigraft
