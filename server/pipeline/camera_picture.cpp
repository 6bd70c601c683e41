#include "server/pipeline/camera_picture.h"

#include <cmath>

#include "capture/camera/response.h"

namespace lumigraft::server {

capture::Image<std::uint8_t> camera_picture(const capture::Frame& color) {
  if (!color.encoded.empty()) {
    return color.encoded;
  }
  capture::Image<std::uint8_t> shown(color.radiance.width, color.radiance.height, 3);
  for (std::size_t i = 0; i < shown.data.size(); ++i) {
    const float linear = static_cast<float>(color.exposure) * color.radiance.data[i];
    shown.data[i] = static_cast<std::uint8_t>(std::lround(255.0f * capture::linear_to_srgb(linear)));
  }
  return shown;
}

}  // namespace lumigraft::server
