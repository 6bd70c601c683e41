#include "relight/passes/reflect.h"

namespace lumigraft {

Reflect::Reflect(gpu::Device& device) : pipeline_(device.create_compute("reflect.comp")) {}

void Reflect::record(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes,
                     const Screen& screen) const {
  dispatch_tiles(
      list, *pipeline_,
      joined(volumes.bindings(), {gpu::sampled(12, *screen.real_position), gpu::sampled(13, *screen.real_normal),
                                  gpu::sampled(14, *screen.real_albedo), gpu::sampled(15, *screen.object_surface),
                                  gpu::sampled(25, *screen.mirror_lost), gpu::sampled(17, *screen.mirror_all),
                                  gpu::sampled(26, *screen.radiance), gpu::image(18, *screen.mirror_gained),
                                  gpu::image(19, *screen.mirror_share)}),
      params, screen.tiles->changed());
}

}  // namespace lumigraft
