#include "relight/passes/screen/shade.h"

namespace lumigraft::relight {

Shade::Shade(gpu::Device& device) : pipeline_(device.create_compute("shade.comp")) {}

void Shade::record(gpu::CommandList& list, shader::FrameParams params, const LampMaps& maps, const Volumes& volumes,
                   const Screen& screen) const {
  params.pass_i.x() = screen.ambient_scale;
  dispatch_tiles(list, *pipeline_,
                 joined(joined(volumes.bindings(), maps.bindings()),
                        {gpu::sampled(12, *screen.object_normal), gpu::sampled(13, *screen.object_base),
                         gpu::sampled(14, *screen.object_surface), gpu::sampled(15, *screen.rays),
                         gpu::sampled(17, *screen.object_irradiance), gpu::sampled(18, *screen.object_mirrored),
                         gpu::sampled(19, *screen.object_open), gpu::image(16, *screen.object_radiance)}),
                 params, screen.tiles->objects());
}

}  // namespace lumigraft::relight
