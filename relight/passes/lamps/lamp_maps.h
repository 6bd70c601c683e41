#pragma once
// Shadow maps of the objects: depth from several points of each lamp, whose mean is the penumbra (Heckbert & Herf
// 1997). Surfaces thinner than a voxel cast full shadows too. In: objects, lamps. Out: bindings(), and the number of
// maps per lamp in the frame's parameters.
#include "relight/passes/dispatch.h"
#include "relight/upload/object_store.h"

namespace lumigraft::relight {

class LampMaps {
 public:
  /// About `max_maps` maps of edge² texels (edge a multiple of 32) for all of at most `max_lamps` lamps together, at
  /// least one each; 0: none.
  LampMaps(gpu::Device& device, int edge, int max_maps, int max_lamps);

  /// Distributes the maps among the lamps and writes their number to `params`. A lamp inside the sphere around the
  /// objects gets none: no map covers its field of view.
  void choose(gpu::Device& device, shader::FrameParams& params);
  /// `rough`: draw the objects' coarsest meshes.
  void record(gpu::CommandList& list, const std::vector<PlacedObject>& objects, bool rough,
              const gpu::Texture& white) const;

  /// For passes that include lamp_maps.glsl.
  std::vector<gpu::Binding> bindings() const;

 private:
  int edge_, max_maps_;
  std::unique_ptr<gpu::RasterPipeline> raster_;
  std::unique_ptr<gpu::ComputePipeline> bound_;
  std::unique_ptr<gpu::Texture> depths_;  ///< the maps in one atlas, side by side
  std::unique_ptr<gpu::Buffer> views_, bounds_;
  std::vector<shader::DrawParams> draws_;
};

}  // namespace lumigraft::relight
