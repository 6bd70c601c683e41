#pragma once
// Bounces beyond the first. In: listed_virtual, cells, all volumes. Out: gathered_virtual, at the voxels near surfaces;
// real_irradiance, at the cells.
// resolve: converts flux and gathered light to radiance. In: listed_virtual, listed_real, virtual_flux, real_flux
// (Inject), gathered_virtual, real_irradiance, real_albedo, real_radiance level 0 (SurfaceFill), virtual_distance
// (SurfaceFill). Out: level 0 of virtual_radiance and real_change, in the listed voxels only.
// filter: builds the hierarchy of a pool of chunks, level by level. In: level 0, premultiplied by its weight. Out: the
// coarser levels.
// The enclosure around the reconstructed room, and the change of its light (see shaders/volume/volume.glsl):
// light_enclosure: in: lamps, distances, real_radiance, the environment; out: enclosure_response, enclosure_lost.
// change_enclosure: in: both, distances, virtual_radiance, real_change, the environment, enclosure_change of the
// previous round; out: enclosure_change.
#include "relight/passes/dispatch.h"
#include "relight/passes/lamps/lamp_maps.h"
#include "relight/passes/volume/volumes.h"

namespace lumigraft::relight {

class Bounce {
 public:
  explicit Bounce(gpu::Device& device);
  /// Fills `cells`, from real_radiance and the objects. `min_fraction`: minimum fraction of its hemisphere that the
  /// objects must cover for a real cell to gather.
  void list_cells(gpu::CommandList& list, shader::FrameParams params, float min_fraction, const Volumes& volumes) const;
  void gather_virtual(gpu::CommandList& list, const shader::FrameParams& params, Slice slice, const LampMaps& maps,
                      const Volumes& volumes) const;
  /// Writes `irradiance`. `mirrored_lamps`: include the light of lamps reflected by mirrors that the objects block; for
  /// pixels the shadow pass computes it.
  void gather_real(gpu::CommandList& list, shader::FrameParams params, int change_cones, bool mirrored_lamps,
                   Slice slice, const LampMaps& maps, const gpu::Texture& irradiance, const Volumes& volumes) const;
  /// From rough_irradiance to real_irradiance.
  void smooth_real(gpu::CommandList& list, const shader::FrameParams& params, const Volumes& volumes) const;
  void resolve(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes) const;
  void filter(gpu::CommandList& list, shader::FrameParams params, const ChunkSet& chunks, const gpu::Texture& pool,
              const Volumes& volumes) const;
  void light_enclosure(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes) const;
  void change_enclosure(gpu::CommandList& list, shader::FrameParams params, Volumes& volumes) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> cells_, virtual_, real_, smooth_, resolve_, mean_;
  std::unique_ptr<gpu::ComputePipeline> enclosure_light_, enclosure_change_;
};

}  // namespace lumigraft::relight
