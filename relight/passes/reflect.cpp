#include "relight/passes/reflect.h"

namespace lumigraft {

Reflect::Reflect(gpu::Device& device)
    : trace_(device.create_compute("reflect.comp")), smooth_(device.create_compute("mirror_smooth.comp")) {}

void Reflect::record(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes,
                     const Screen& screen) const {
  dispatch_tiles(
      list, *trace_,
      joined(volumes.bindings(), {gpu::sampled(12, *screen.real_position), gpu::sampled(13, *screen.real_normal),
                                  gpu::sampled(14, *screen.real_albedo), gpu::sampled(15, *screen.object_surface),
                                  gpu::sampled(25, *screen.mirror_lost), gpu::sampled(17, *screen.mirror_all),
                                  gpu::sampled(26, *screen.radiance), gpu::image(18, *screen.mirror_gained),
                                  gpu::image(19, *screen.mirror_share)}),
      params, screen.tiles->changed());
  dispatch_tiles(
      list, *smooth_,
      joined(volumes.bindings(), {gpu::sampled(12, *screen.real_position), gpu::sampled(13, *screen.real_normal),
                                  gpu::sampled(14, *screen.real_albedo), gpu::sampled(15, *screen.mirror_gained),
                                  gpu::sampled(17, *screen.mirror_share), gpu::image(18, *screen.mirror_gained_smooth),
                                  gpu::image(19, *screen.mirror_share_smooth)}),
      params, screen.tiles->changed());
}

}  // namespace lumigraft
