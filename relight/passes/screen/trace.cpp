#include "relight/passes/screen/trace.h"

namespace lumigraft::relight {

Trace::Trace(gpu::Device& device) : pipeline_(device.create_compute("trace.comp")) {}

void Trace::record(gpu::CommandList& list, shader::FrameParams params, int change_cones, const Volumes& volumes,
                   const Screen& screen) const {
  params.pass_i.x() = change_cones;
  dispatch_tiles(
      list, *pipeline_,
      joined(volumes.bindings(), {gpu::sampled(12, *screen.real_position), gpu::sampled(13, *screen.real_normal),
                                  gpu::sampled(14, *screen.object_surface), gpu::sampled(15, *screen.real_albedo),
                                  gpu::image(16, *screen.traced)}),
      params, screen.tiles->traces());
}

}  // namespace lumigraft::relight
