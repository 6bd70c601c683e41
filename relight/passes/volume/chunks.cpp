#include "relight/passes/volume/chunks.h"

#include <algorithm>
#include <cstring>

#include "relight/shaders/common/interop.h"

namespace lumigraft::relight {
namespace {

constexpr int kLayer = shader::kChunkRow * shader::kChunkRow;  // chunks
constexpr int kVoxels = shader::kChunkEdge * shader::kChunkEdge * shader::kChunkEdge;

/// With a reserve for moving objects, and at most twice what is needed.
bool fits(int room, int chunks) { return room >= chunks && room <= 2 * chunks + kLayer; }
int with_spare(int chunks) { return (chunks + chunks / 8 + kLayer - 1) / kLayer * kLayer; }

}  // namespace

int chunks_along(int edge_voxels, int level) { return std::max((edge_voxels >> level) / shader::kChunkEdge, 1); }

std::size_t chunk_places(int edge_voxels, int levels) {
  std::size_t places = 0;
  for (int level = 0; level < levels; ++level) {
    const auto along = static_cast<std::size_t>(chunks_along(edge_voxels, level));
    places += shader::kCascades * along * along * along;
  }
  return places;
}

ChunkSet::ChunkSet(gpu::Device& device, Surfaces kind, int edge_voxels, int levels)
    : kind_(kind), edge_(edge_voxels), levels_(levels), first_(static_cast<std::size_t>(levels) + 1, 1) {
  marks_ = device.create_buffer(sizeof(std::uint32_t) * chunk_places(edge_, levels_), "marked chunks");
}

void ChunkSet::number(gpu::Device& device, const gpu::Buffer& table) {
  const std::vector<std::byte> marks = device.download(*marks_);
  std::vector<std::uint32_t> numbers(marks.size() / sizeof(std::uint32_t)), places;
  std::memcpy(numbers.data(), marks.data(), marks.size());
  std::size_t at = 0;
  for (int level = 0; level < levels_; ++level) {
    first_[static_cast<std::size_t>(level)] = static_cast<int>(places.size()) + 1;
    const auto along = static_cast<std::uint32_t>(chunks_along(edge_, level));
    for (std::uint32_t c = 0; c < shader::kCascades; ++c) {
      for (std::uint32_t z = 0; z < along; ++z) {
        for (std::uint32_t y = 0; y < along; ++y) {
          for (std::uint32_t x = 0; x < along; ++x, ++at) {
            if (numbers[at] == 0) continue;
            places.push_back(x | y << 5 | z << 10 | c << 15);
            numbers[at] = static_cast<std::uint32_t>(places.size());
          }
        }
      }
    }
  }
  first_.back() = static_cast<int>(places.size()) + 1;
  device.upload(table, static_cast<std::size_t>(kind_) * marks.size(), std::as_bytes(std::span(numbers)));
  const auto words = std::as_bytes(std::span(places));
  if (!places_ || places_->size_bytes() < words.size()) {
    places_ = device.create_buffer(words.size() + words.size() / 8 / 4 * 4 + 4, "places of chunks");
  }
  device.upload(*places_, 0, words);
}

void fit_pool(gpu::Device& device, const char* name, int chunks, std::unique_ptr<gpu::Texture>* pool) {
  constexpr int texels = shader::kChunkEdge + 1;
  if (*pool && fits((*pool)->desc().depth / texels * kLayer, chunks)) return;
  pool->reset();  // device memory may not suffice for both
  *pool = device.create_texture(gpu::volume_desc(name, shader::kChunkRow * texels, shader::kChunkRow * texels,
                                                 with_spare(chunks) / kLayer * texels, gpu::Format::rgba16_float));
}

void fit_values(gpu::Device& device, const char* name, int chunks, int values, std::unique_ptr<gpu::Buffer>* buffer) {
  const std::size_t chunk_bytes = sizeof(std::uint32_t) * kVoxels * static_cast<std::size_t>(values);
  if (*buffer && fits(static_cast<int>((*buffer)->size_bytes() / chunk_bytes), chunks)) return;
  buffer->reset();
  *buffer = device.create_buffer(chunk_bytes * static_cast<std::size_t>(with_spare(chunks)), name);
}

}  // namespace lumigraft::relight
