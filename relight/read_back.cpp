#include "relight/read_back.h"

#include <algorithm>

namespace lumigraft::relight {
namespace {

capture::Image<float> read_floats(gpu::Device& device, const gpu::Texture& texture, int first, int channels) {
  const std::vector<std::byte> bytes = device.download(texture);
  const bool halves = texture.desc().format == gpu::Format::rgba16_float;
  capture::Image<float> image(texture.desc().width, texture.desc().height, channels);
  const std::size_t pixels = static_cast<std::size_t>(image.width) * image.height;
  const auto* half = reinterpret_cast<const Eigen::half*>(bytes.data());
  const auto* full = reinterpret_cast<const float*>(bytes.data());
  for (std::size_t i = 0; i < pixels; ++i) {
    for (int c = 0; c < channels; ++c) {
      const std::size_t at = 4 * i + static_cast<std::size_t>(first + c);
      image.data[i * channels + c] = halves ? static_cast<float>(half[at]) : full[at];
    }
  }
  return image;
}

}  // namespace

std::shared_ptr<const RelightMaps> read_maps(gpu::Device& device, const Screen& screen) {
  auto maps = std::make_shared<RelightMaps>();
  maps->albedo = read_floats(device, *screen.real_albedo, 0, 3);
  maps->normals = read_floats(device, *screen.real_normal, 0, 3);
  maps->depth_m = read_floats(device, *screen.real_position, 3, 1);
  for (float& z : maps->depth_m.data) z = std::max(z, 0.0f);  // negative: estimated
  maps->delta = read_floats(device, *screen.delta, 0, 3);
  maps->mask = read_floats(device, *screen.delta, 3, 1);
  // Where an object covers a pixel, the maps describe the object.
  const capture::Image<float> base = read_floats(device, *screen.object_base, 0, 3);
  const capture::Image<float> normal = read_floats(device, *screen.object_normal, 0, 3);
  const capture::Image<float> z = read_floats(device, *screen.object_surface, 0, 1);
  for (std::size_t i = 0; i < maps->mask.data.size(); ++i) {
    if (maps->mask.data[i] < 0.5f) continue;
    maps->depth_m.data[i] = z.data[i];
    for (std::size_t c = 0; c < 3; ++c) {
      maps->albedo.data[3 * i + c] = base.data[3 * i + c];
      maps->normals.data[3 * i + c] = normal.data[3 * i + c];
    }
  }
  return maps;
}

capture::Image<std::uint8_t> with_drawn_blocks(const capture::Image<std::uint8_t>& coded,
                                               std::span<const std::byte> drawn, const Screen& screen) {
  capture::Image<std::uint8_t> picture = coded;
  for (const std::uint32_t place : screen.tiles->view_places()) {
    const int left = kTile_px * static_cast<int>(place & 0xffff), top = kTile_px * static_cast<int>(place >> 16);
    for (int v = top; v < std::min(top + kTile_px, screen.height); ++v) {
      for (int u = left; u < std::min(left + kTile_px, screen.width); ++u) {
        const std::size_t i = static_cast<std::size_t>(v) * screen.width + u;
        for (std::size_t c = 0; c < 3; ++c) picture.data[3 * i + c] = static_cast<std::uint8_t>(drawn[4 * i + c]);
      }
    }
  }
  return picture;
}

}  // namespace lumigraft::relight
