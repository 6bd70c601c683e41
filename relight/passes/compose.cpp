#include "relight/passes/compose.h"

namespace lumigraft {

Compose::Compose(gpu::Device& device)
    : pipeline_(device.create_compute("compose.comp")), smooth_(device.create_compute("compose_smooth.comp")) {}

void Compose::record(gpu::CommandList& list, shader::FrameParams params, bool smooth, const Screen& screen) const {
  const std::vector<gpu::Binding> bindings{gpu::sampled(1, *screen.codes),
                                           gpu::sampled(2, *screen.radiance),
                                           gpu::sampled(3, *screen.real_normal),
                                           gpu::sampled(4, *screen.real_albedo),
                                           gpu::sampled(5, *screen.direct_lost),
                                           gpu::sampled(6, *screen.indirect),
                                           gpu::sampled(7, *screen.mirror_gained_smooth),
                                           gpu::sampled(8, *screen.mirror_share_smooth),
                                           gpu::sampled(9, *screen.object_radiance),
                                           gpu::sampled(10, *screen.object_surface),
                                           gpu::image(12, *screen.picture),
                                           gpu::image(13, *screen.delta)};
  dispatch_tiles(list, *pipeline_, bindings, params, smooth ? screen.tiles->fine() : screen.tiles->views());
  if (!smooth) return;
  params.pass_i.x() = kSmoothStep;
  dispatch_tiles(list, *smooth_,
                 {gpu::sampled(1, *screen.codes), gpu::sampled(2, *screen.radiance), gpu::sampled(3, *screen.gain),
                  gpu::image(12, *screen.picture)},
                 params, screen.tiles->smooth_views());
}

}  // namespace lumigraft
