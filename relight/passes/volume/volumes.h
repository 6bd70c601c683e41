#pragma once
// The volumes passed between passes (content: shaders/volume/volume.glsl). Distances and cells are dense, both cascades
// stacked along z in one texture. All else is stored in chunks near surfaces (passes/volume/chunks.h): its memory grows
// with surface area, not with volume.
#include <Eigen/Core>
#include <memory>

#include "relight/gpu/device.h"
#include "relight/passes/volume/chunks.h"
#include "relight/shaders/common/interop.h"

namespace lumigraft::relight {

struct Volumes {
  int edge = 0, mips = 0;
  // The virtual volume; allocated by fit_virtual. Reflectance: for uniform incident light.
  std::unique_ptr<gpu::Texture> virtual_distance, virtual_reflectance;
  std::unique_ptr<gpu::Texture> real_distance;
  ChunkSet real_chunks, virtual_chunks;
  std::unique_ptr<gpu::Buffer> chunk_table;  ///< of both kinds
  // Pools of chunks; allocated by fit_chunks.
  std::unique_ptr<gpu::Texture> real_albedo, real_normal;  ///< level 0 only
  std::unique_ptr<gpu::Texture> real_response;             ///< ρ/π over the measured radiance (live_real.glsl)
  std::unique_ptr<gpu::Texture> real_radiance, virtual_radiance, real_change;  ///< with all levels
  std::unique_ptr<gpu::Texture> gathered_virtual;                              ///< radiance by bounces beyond the first
  std::unique_ptr<gpu::Buffer> virtual_flux, real_flux;                        ///< fixed point
  std::unique_ptr<gpu::Buffer> virtual_area;                                   ///< fixed point, voxel faces
  std::unique_ptr<gpu::Texture> real_irradiance;   ///< its change by bounces, one texel per cell of 2³ voxels
  std::unique_ptr<gpu::Texture> rough_irradiance;  ///< the same before smoothing; allocated by fit_cells
  std::unique_ptr<gpu::Buffer> listed_virtual;     ///< voxels near virtual surfaces
  std::unique_ptr<gpu::Buffer> listed_real;        ///< voxels near real surfaces; a voxel may be in both lists
  std::unique_ptr<gpu::Buffer> cells;              ///< of 2³ voxels, containing real surface near the objects
  std::unique_ptr<gpu::Texture> environment;
  const gpu::Texture* mirror_outlines = nullptr;  ///< of surfaces with known material; not owned
  const gpu::Buffer* gone_cells = nullptr;        ///< GoneCells; not owned
  // Octahedral maps of the enclosure around the reconstructed room.
  std::unique_ptr<gpu::Texture> enclosure_response, enclosure_lost;         ///< radiance over irradiance; lamps' loss
  std::unique_ptr<gpu::Texture> enclosure_change, enclosure_change_before;  ///< change of radiance, last two rounds

  Volumes(gpu::Device& device, int edge_voxels);
  void fit_cells(gpu::Device& device, bool smooth);
  void fit_virtual(gpu::Device& device, const Eigen::Vector3i& size);
  /// Allocates the chunks that were marked for one kind of surface. A pool that must be reallocated loses its content.
  void fit_chunks(gpu::Device& device, Surfaces kind);

  /// As declared in volume.glsl.
  std::vector<gpu::Binding> bindings() const;
  /// As declared in chunks.glsl.
  gpu::Binding chunks() const { return gpu::storage(32, *chunk_table); }
  /// As declared in volume.glsl, for passes with shadow cones.
  gpu::Binding gone() const { return gpu::storage(34, *gone_cells); }
};

}  // namespace lumigraft::relight
