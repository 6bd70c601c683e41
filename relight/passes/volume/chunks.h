#pragma once
// Which chunks of 8³ texels of the volumes' hierarchies exist for one kind of surface (shaders/chunks.glsl), and the
// textures that hold them. A pass marks them (VoxelList); they are numbered on the host, level by level, so that there
// is room for as many as there are.
#include <memory>
#include <vector>

#include "relight/gpu/device.h"

namespace lumigraft::relight {

/// Of all that volumes hold of surfaces.
enum class Surfaces { real = 0, virt = 1 };

/// Chunks along the edge of a level of volumes of so many voxels.
int chunks_along(int edge_voxels, int level);
/// In the table of one kind: places of chunks, of both cascades and all levels.
std::size_t chunk_places(int edge_voxels, int levels);

class ChunkSet {
 public:
  ChunkSet(gpu::Device& device, Surfaces kind, int edge_voxels, int levels);

  Surfaces kind() const { return kind_; }
  const gpu::Buffer& marks() const { return *marks_; }    ///< laid out as the table; 1: is to exist
  const gpu::Buffer& places() const { return *places_; }  ///< of chunk 1 and up, as chunk_mean.comp reads them
  int first(int level) const { return first_[static_cast<std::size_t>(level)]; }  ///< number of its first chunk
  int count(int level) const { return first(level + 1) - first(level); }
  int finest() const { return first(1); }    ///< numbers of level 0, with that of the chunk that holds nothing
  int all() const { return first_.back(); }  ///< numbers of all levels, likewise

  /// Reads the marks, numbers what is marked and writes its own part of the table of both kinds.
  void number(gpu::Device& device, const gpu::Buffer& table);

 private:
  Surfaces kind_;
  int edge_, levels_;
  std::unique_ptr<gpu::Buffer> marks_, places_;
  std::vector<int> first_;
};

/// Makes a texture that has room for so many chunks, unless `pool` is one of about that size.
void fit_pool(gpu::Device& device, const char* name, int chunks, std::unique_ptr<gpu::Texture>* pool);
/// A buffer of `values` 32-bit numbers a voxel of so many chunks, likewise.
void fit_values(gpu::Device& device, const char* name, int chunks, int values, std::unique_ptr<gpu::Buffer>* buffer);

}  // namespace lumigraft::relight
