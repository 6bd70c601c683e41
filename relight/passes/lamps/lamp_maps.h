#pragma once
// What lamps see of the objects: depth from several points of each lamp, so that their mean is the penumbra (Heckbert &
// Herf 1997). Surfaces thinner than any voxel cast a whole shadow. In: objects, lamps. Out: bindings(), and in the
// lamps of the frame's parameters how many maps each has.
#include "relight/passes/dispatch.h"
#include "relight/upload/object_store.h"

namespace lumigraft::relight {

class LampMaps {
 public:
  /// About `most` maps of edge × edge texels, a multiple of 32, for all lamps together, of which each has one at least;
  /// 0: none.
  LampMaps(gpu::Device& device, int edge, int most);

  /// Shares the maps out among the lamps and says so in `params`. A lamp within the sphere around the objects gets
  /// none: no map can hold all that it sees.
  void choose(gpu::Device& device, shader::FrameParams& params);
  /// `rough`: of the objects' roughest triangles.
  void record(gpu::CommandList& list, const std::vector<PlacedObject>& objects, bool rough,
              const gpu::Texture& white) const;

  /// For passes that include lamp_maps.glsl.
  std::vector<gpu::Binding> bindings() const;

 private:
  int edge_, most_;
  std::unique_ptr<gpu::RasterPipeline> raster_;
  std::unique_ptr<gpu::ComputePipeline> bound_;
  std::unique_ptr<gpu::Texture> depths_;  ///< the maps side by side
  std::unique_ptr<gpu::Buffer> views_, bounds_;
  std::vector<shader::DrawParams> draws_;
};

}  // namespace lumigraft::relight
