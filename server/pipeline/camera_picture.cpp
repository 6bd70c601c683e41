#include "server/pipeline/camera_picture.h"

#include "capture/camera/srgb.h"

namespace lumigraft::server {

capture::Image<std::uint8_t> camera_picture(const capture::Frame& color) {
  if (!color.encoded.empty()) return color.encoded;
  capture::Image<std::uint8_t> shown(color.radiance.width, color.radiance.height, 3);
  for (std::size_t i = 0; i < shown.data.size(); ++i) {
    shown.data[i] = capture::srgb_table().code(static_cast<float>(color.exposure) * color.radiance.data[i]);
  }
  return shown;
}

}  // namespace lumigraft::server
