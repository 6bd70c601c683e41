#pragma once
// Pairs of reflective shadow maps and split-inject (thesis §5.4.1). For every lamp the objects are rendered from the
// lamp (R_rho); the real surface behind each texel (R_mu) is found by tracing the distance field. In: objects,
// real_distance, real_albedo. Out: virtual_flux, real_flux.
#include "relight/passes/dispatch.h"
#include "relight/passes/lamps/object_draw.h"
#include "relight/passes/volume/volumes.h"

namespace lumigraft::relight {

class Inject {
 public:
  Inject(gpu::Device& device, int map_edge);
  /// Chooses the fixed-point unit such that no voxel can overflow, and writes it to params.field.
  void choose_unit(const std::vector<PlacedObject>& objects, shader::FrameParams& params) const;
  static void clear(gpu::CommandList& list, const Volumes& volumes);
  void record(gpu::CommandList& list, shader::FrameParams params, int lamp, const std::vector<PlacedObject>& objects,
              const gpu::Texture& white, const Volumes& volumes) const;
  /// The light of objects that emit. In: their surface samples, virtual_distance. Out: virtual_flux.
  void record_emission(gpu::CommandList& list, shader::FrameParams params, const std::vector<PlacedObject>& objects,
                       const Volumes& volumes) const;

 private:
  int edge_;
  std::unique_ptr<gpu::RasterPipeline> raster_;
  std::unique_ptr<gpu::ComputePipeline> inject_, emit_;
  std::unique_ptr<gpu::Texture> position_, albedo_, normal_, z_;
};

}  // namespace lumigraft::relight
