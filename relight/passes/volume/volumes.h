#pragma once
// The volumes that passes hand to one another (see shaders/volume.glsl for what they hold). Distances and cells are
// dense, both cascades in one texture, one above the other along z. All else is kept near surfaces alone, in chunks
// (passes/chunks.h): it follows their area, not the cube.
#include <Eigen/Core>
#include <memory>

#include "relight/gpu/device.h"
#include "relight/passes/volume/chunks.h"
#include "relight/shaders/common/interop.h"

namespace lumigraft::relight {

struct Volumes {
  int edge = 0, mips = 0;
  // Of the virtual volume; made by fit_virtual. Reflectance: of evenly arriving light.
  std::unique_ptr<gpu::Texture> virtual_distance, virtual_reflectance;
  std::unique_ptr<gpu::Texture> real_distance;
  ChunkSet real_chunks, virtual_chunks;
  std::unique_ptr<gpu::Buffer> chunk_table;  ///< of both
  // Pools of chunks; made by fit_chunks.
  std::unique_ptr<gpu::Texture> real_albedo, real_normal;  ///< level 0 alone
  std::unique_ptr<gpu::Texture> real_response;  ///< of the measured radiance to irradiance, relative (live_real.glsl)
  std::unique_ptr<gpu::Texture> real_radiance, virtual_radiance, real_change;  ///< with their hierarchy
  std::unique_ptr<gpu::Texture> gathered_virtual;                              ///< radiance by bounces beyond the first
  std::unique_ptr<gpu::Buffer> virtual_flux, real_flux;                        ///< fixed point
  std::unique_ptr<gpu::Buffer> virtual_area;                                   ///< fixed point, voxel faces
  std::unique_ptr<gpu::Texture> real_irradiance;   ///< change of it by bounces, one texel a cell of 2³ voxels
  std::unique_ptr<gpu::Texture> rough_irradiance;  ///< the same before it is smoothed; made by fit_cells
  std::unique_ptr<gpu::Buffer> listed_virtual;     ///< voxels near virtual surfaces
  std::unique_ptr<gpu::Buffer> listed_real;        ///< the same of real ones; a voxel may be in both
  std::unique_ptr<gpu::Buffer> cells;              ///< of 2³ voxels, with real surface near the objects
  std::unique_ptr<gpu::Texture> environment;
  const gpu::Texture* mirror_outlines = nullptr;  ///< of known surfaces; not the volumes' own
  // Octahedral maps of what surrounds the known room.
  std::unique_ptr<gpu::Texture> enclosure_response, enclosure_lost;         ///< radiance over irradiance; lamps' loss
  std::unique_ptr<gpu::Texture> enclosure_change, enclosure_change_before;  ///< radiance, of the last two rounds

  Volumes(gpu::Device& device, int edge_voxels);
  void fit_cells(gpu::Device& device, bool smooth);
  void fit_virtual(gpu::Device& device, const Eigen::Vector3i& size);
  /// Takes the chunks that were marked for one kind of surface. What pools held is lost where it must be made anew.
  void fit_chunks(gpu::Device& device, Surfaces kind);

  /// As volume.glsl declares them.
  std::vector<gpu::Binding> bindings() const;
  /// As chunks.glsl does.
  gpu::Binding chunks() const { return gpu::storage(32, *chunk_table); }
};

/// Texels along the edge of the octahedral map of the enclosure.
constexpr int kEnclosureEdge = 24;

/// Groups of 64 threads that walk the list of voxels together.
constexpr int kListGroups = 256;

}  // namespace lumigraft::relight
