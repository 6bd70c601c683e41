#include "relight/passes/volume/real_fill.h"

namespace lumigraft::relight {

RealFill::RealFill(gpu::Device& device)
    : distances_(device.create_compute("real_fill.comp")),
      list_(device.create_compute("voxel_list_real.comp")),
      surfaces_(device.create_compute("real_surface.comp")) {}

void RealFill::distances(gpu::CommandList& list, const shader::FrameParams& params, const BrickPool& bricks,
                         const Volumes& volumes) const {
  dispatch_cascades(list, *distances_, joined(bricks.distance_bindings(), {gpu::image(1, *volumes.real_distance)}),
                    params, volumes.edge);
  const gpu::Buffer& marks = volumes.real_chunks.marks();
  list.fill(*volumes.listed_real, 0);
  list.fill(marks, 0);
  dispatch_cascades(
      list, *list_,
      {gpu::storage(28, *volumes.listed_real), gpu::storage(33, marks), gpu::image(12, *volumes.real_distance)}, params,
      volumes.edge);
}

void RealFill::surfaces(gpu::CommandList& list, const shader::FrameParams& params, const BrickPool& bricks,
                        const Volumes& volumes) const {
  list.clear(*volumes.real_radiance, {});
  list.clear(*volumes.real_albedo, {});
  list.clear(*volumes.real_normal, {});
  list.clear(*volumes.real_response, {});
  dispatch_list(list, *surfaces_,
                joined(bricks.bindings(),
                       {gpu::storage(28, *volumes.listed_real), gpu::image(1, *volumes.real_distance),
                        gpu::image(2, *volumes.real_radiance), gpu::image(3, *volumes.real_albedo),
                        gpu::image(4, *volumes.real_normal), gpu::image(5, *volumes.real_response), volumes.chunks()}),
                params);
}

}  // namespace lumigraft::relight
