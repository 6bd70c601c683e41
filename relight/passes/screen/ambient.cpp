#include "relight/passes/screen/ambient.h"

namespace lumigraft::relight {

Ambient::Ambient(gpu::Device& device) : pipeline_(device.create_compute("ambient.comp")) {}

void Ambient::record(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes,
                     const Screen& screen) const {
  params.pass_i.x() = screen.ambient_scale;
  dispatch_tiles(
      list, *pipeline_,
      joined(volumes.bindings(), {gpu::sampled(12, *screen.object_normal), gpu::sampled(13, *screen.object_base),
                                  gpu::sampled(14, *screen.object_surface), gpu::sampled(15, *screen.rays),
                                  gpu::image(16, *screen.object_irradiance), gpu::image(17, *screen.object_mirrored),
                                  gpu::image(18, *screen.object_open)}),
      params, screen.tiles->ambients());
}

}  // namespace lumigraft::relight
