#include "relight/compose/read_tiles.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <memory>
#include <opencv2/core.hpp>

namespace lumigraft::relight {
namespace {

/// `act(first, texels)` for each row of a block: index of its first texel, in an image that has one of `step` pixels
/// along each axis.
template <typename Act>
void for_each_row(std::uint32_t place, int step, int columns, int rows, Act act) {
  const int left = left_of(place) / step, right = std::min((left_of(place) + kTile_px) / step, columns);
  for (int v = top_of(place) / step; v < std::min((top_of(place) + kTile_px) / step, rows); ++v) {
    act(static_cast<std::size_t>(v) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(left),
        static_cast<std::size_t>(std::max(right - left, 0)));
  }
}

gpu::Area area_around(const WantedTiles& wanted) {
  if (wanted.places.empty()) return {};
  cv::Rect around;
  for (const std::uint32_t place : wanted.places) around |= {left_of(place), top_of(place), kTile_px, kTile_px};
  const gpu::TextureDesc& desc = wanted.texture.desc();
  const int x = around.x / wanted.step, y = around.y / wanted.step;
  return {x, y, std::min(around.br().x / wanted.step, desc.width) - x,
          std::min(around.br().y / wanted.step, desc.height) - y};
}

std::size_t channels_of(gpu::Format format) { return format == gpu::Format::r32_float ? 1 : 4; }

/// By their bits: converted one by one they took most of the time of reading a picture.
const std::array<float, 65536>& floats_of_halves() {
  static const auto table = [] {
    auto values = std::make_unique<std::array<float, 65536>>();
    for (std::size_t bits = 0; bits < values->size(); ++bits) {
      (*values)[bits] =
          static_cast<float>(Eigen::half(Eigen::half_impl::raw_uint16_to_half(static_cast<std::uint16_t>(bits))));
    }
    return values;
  }();
  return *table;
}

}  // namespace

TileReader::TileReader(gpu::Device& device, std::span<const WantedTiles> wanted) {
  std::vector<gpu::TexturePart> areas;
  for (const WantedTiles& tiles : wanted) {
    parts_.push_back({tiles, area_around(tiles), {}});
    if (parts_.back().area.width > 0) areas.push_back({&tiles.texture, parts_.back().area});
  }
  std::vector<std::vector<std::byte>> texels = device.download(areas);
  auto next = texels.begin();
  for (Part& part : parts_) {
    if (part.area.width > 0) part.texels = std::move(*next++);
  }
}

void TileReader::read(std::size_t number, int first, int channels, std::vector<float>* out) const {
  const Part& part = parts_[number];
  const gpu::TextureDesc& desc = part.wanted.texture.desc();
  const std::size_t of_texel = channels_of(desc.format);
  const auto n = static_cast<std::size_t>(channels), columns = static_cast<std::size_t>(desc.width);
  const bool halves = desc.format == gpu::Format::rgba16_float;
  const auto* half = reinterpret_cast<const std::uint16_t*>(part.texels.data()) + first;
  const auto* full = reinterpret_cast<const float*>(part.texels.data()) + first;
  const std::array<float, 65536>& of_half = floats_of_halves();
  out->resize(n * columns * static_cast<std::size_t>(desc.height));
  for (const std::uint32_t place : part.wanted.places) {
    for_each_row(place, part.wanted.step, desc.width, desc.height, [&](std::size_t row, std::size_t count) {
      const std::size_t u = row % columns - static_cast<std::size_t>(part.area.x),
                        v = row / columns - static_cast<std::size_t>(part.area.y),
                        from = of_texel * (v * static_cast<std::size_t>(part.area.width) + u);
      for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t c = 0; c < n; ++c) {
          const std::size_t at = from + of_texel * i + c;
          (*out)[n * (row + i) + c] = halves ? of_half[half[at]] : full[at];
        }
      }
    });
  }
}

std::array<WantedTiles, 2> object_tiles(const Screen& screen, const std::vector<std::uint32_t>& places) {
  return {WantedTiles{*screen.object_layer, places}, WantedTiles{*screen.object_z, places}};
}

void read_objects(const TileReader& reader, std::size_t number, const Screen& screen, const std::vector<float>& rays,
                  const std::vector<std::uint32_t>& places, ObjectLayer* objects) {
  if (objects->coverage.width != screen.width || objects->coverage.height != screen.height) {
    const capture::Image<float> none(screen.width, screen.height, 1);
    *objects = {0, 0, capture::Image<float>(screen.width, screen.height, 3), none, none};
  }
  reader.read(number, 0, 3, &objects->radiance.data);
  reader.read(number, 3, 1, &objects->coverage.data);
  std::vector<float>& distance_m = objects->distance_m.data;
  reader.read(number + 1, 0, 1, &distance_m);
  for (const std::uint32_t place : places) {
    for_each_row(place, 1, screen.width, screen.height, [&](std::size_t row, std::size_t count) {
      for (std::size_t i = row; i < row + count; ++i) {
        const float along_z_m = objects->coverage.data[i] > 0 ? distance_m[i] : 0;
        distance_m[i] = along_z_m * std::sqrt(rays[2 * i] * rays[2 * i] + rays[2 * i + 1] * rays[2 * i + 1] + 1);
      }
    });
  }
}

void clear_objects(std::uint32_t place, ObjectLayer* objects) {
  for_each_row(place, 1, objects->coverage.width, objects->coverage.height, [&](std::size_t row, std::size_t count) {
    std::fill_n(&objects->radiance.data[3 * row], 3 * count, 0.0f);
    std::fill_n(&objects->coverage.data[row], count, 0.0f);
    std::fill_n(&objects->distance_m.data[row], count, 0.0f);
  });
}

}  // namespace lumigraft::relight
