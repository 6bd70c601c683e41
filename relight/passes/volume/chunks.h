#pragma once
// Sparse allocation of chunks of 8³ texels for the volumes' hierarchies, for one kind of surface
// (shaders/volume/chunks.glsl). A pass marks the chunks it needs (SurfaceFill); the host numbers them level
// by level, so that the pools have exactly as many.
#include <memory>
#include <vector>

#include "relight/gpu/device.h"

namespace lumigraft::relight {

/// Kind of surface that the volumes represent.
enum class Surfaces { real = 0, virt = 1 };

/// Chunks along the edge of a level, for volumes of so many voxels.
int chunks_along(int edge_voxels, int level);
/// Table entries of one kind: possible chunks of both cascades and all levels.
std::size_t chunk_places(int edge_voxels, int levels);

class ChunkSet {
 public:
  ChunkSet(gpu::Device& device, Surfaces kind, int edge_voxels, int levels);

  Surfaces kind() const { return kind_; }
  const gpu::Buffer& marks() const { return *marks_; }    ///< same layout as the table; 1: chunk is needed
  const gpu::Buffer& places() const { return *places_; }  ///< of chunk 1 and up, as read by chunk_mean.comp
  int first(int level) const { return first_[static_cast<std::size_t>(level)]; }  ///< number of the level's first chunk
  int count(int level) const { return first(level + 1) - first(level); }
  int finest() const { return first(1); }    ///< chunks of level 0, including the empty chunk
  int all() const { return first_.back(); }  ///< chunks of all levels, likewise

  /// Reads the marks, numbers the marked chunks and writes this kind's part of the table.
  void number(gpu::Device& device, const gpu::Buffer& table);

 private:
  Surfaces kind_;
  int edge_, levels_;
  std::unique_ptr<gpu::Buffer> marks_, places_;
  std::vector<int> first_;
};

/// Allocates a texture for so many chunks, unless `pool` already has about that size.
void fit_pool(gpu::Device& device, const char* name, int chunks, std::unique_ptr<gpu::Texture>* pool);
/// A buffer of `values` 32-bit numbers per voxel for so many chunks, likewise.
void fit_values(gpu::Device& device, const char* name, int chunks, int values, std::unique_ptr<gpu::Buffer>* buffer);

}  // namespace lumigraft::relight
