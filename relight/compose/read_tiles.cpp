#include "relight/compose/read_tiles.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace lumigraft::relight {
namespace {

/// `act(index)` for each texel of a block, in an image that has one of `step` pixels along each axis.
template <typename Act>
void for_each_texel(std::uint32_t place, int step, int columns, int rows, Act act) {
  for (int v = top_of(place) / step; v < std::min((top_of(place) + kTile_px) / step, rows); ++v) {
    for (int u = left_of(place) / step; u < std::min((left_of(place) + kTile_px) / step, columns); ++u) {
      act(static_cast<std::size_t>(v) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(u));
    }
  }
}

}  // namespace

TileReader::TileReader(gpu::Device& device, const gpu::Texture& texture)
    : desc_(texture.desc()), texels_(device.download(texture)) {}

void TileReader::read(const std::vector<std::uint32_t>& places, int step, int first, int channels,
                      std::vector<float>* out) const {
  const bool halves = desc_.format == gpu::Format::rgba16_float;
  const std::size_t of_texel = desc_.format == gpu::Format::r32_float ? 1 : 4;
  const auto* half = reinterpret_cast<const Eigen::half*>(texels_.data()) + first;
  const auto* full = reinterpret_cast<const float*>(texels_.data()) + first;
  const auto n = static_cast<std::size_t>(channels);
  out->resize(n * static_cast<std::size_t>(desc_.width) * static_cast<std::size_t>(desc_.height));
  for (const std::uint32_t place : places) {
    for_each_texel(place, step, desc_.width, desc_.height, [&](std::size_t i) {
      for (std::size_t c = 0; c < n; ++c) {
        const std::size_t at = of_texel * i + c;
        (*out)[n * i + c] = halves ? static_cast<float>(half[at]) : full[at];
      }
    });
  }
}

void read_objects(gpu::Device& device, const Screen& screen, const std::vector<float>& rays,
                  const std::vector<std::uint32_t>& places, ObjectLayer* objects) {
  if (objects->coverage.width != screen.width || objects->coverage.height != screen.height) {
    const capture::Image<float> none(screen.width, screen.height, 1);
    *objects = {0, 0, capture::Image<float>(screen.width, screen.height, 3), none, none};
  }
  if (places.empty()) return;
  const TileReader layer(device, *screen.object_layer), z(device, *screen.object_z);
  layer.read(places, 1, 0, 3, &objects->radiance.data);
  layer.read(places, 1, 3, 1, &objects->coverage.data);
  std::vector<float>& distance_m = objects->distance_m.data;
  z.read(places, 1, 0, 1, &distance_m);
  for (const std::uint32_t place : places) {
    for_each_texel(place, 1, screen.width, screen.height, [&](std::size_t i) {
      const float along_z_m = objects->coverage.data[i] > 0 ? distance_m[i] : 0;
      distance_m[i] = along_z_m * std::sqrt(rays[2 * i] * rays[2 * i] + rays[2 * i + 1] * rays[2 * i + 1] + 1);
    });
  }
}

void clear_objects(std::uint32_t place, ObjectLayer* objects) {
  for_each_texel(place, 1, objects->coverage.width, objects->coverage.height, [&](std::size_t i) {
    std::fill_n(&objects->radiance.data[3 * i], 3, 0.0f);
    objects->coverage.data[i] = objects->distance_m.data[i] = 0;
  });
}

}  // namespace lumigraft::relight
