#include "relight/passes/screen/layers.h"

namespace lumigraft::relight {

void Layers::record(gpu::CommandList& list, const shader::FrameParams& params, const Screen& screen) const {
  const std::vector<gpu::Binding> bindings{gpu::sampled(1, *screen.real_position),
                                           gpu::sampled(2, *screen.radiance),
                                           gpu::sampled(3, *screen.real_normal),
                                           gpu::sampled(4, *screen.real_albedo),
                                           gpu::sampled(5, *screen.direct_lost),
                                           gpu::sampled(6, *screen.indirect),
                                           gpu::sampled(7, *screen.mirror_gained_smooth),
                                           gpu::sampled(8, *screen.mirror_fraction_smooth),
                                           gpu::sampled(9, *screen.object_radiance),
                                           gpu::sampled(10, *screen.object_surface),
                                           gpu::sampled(14, *screen.object_normal),
                                           gpu::sampled(15, *screen.object_other),
                                           gpu::image(12, *screen.object_layer),
                                           gpu::image(13, *screen.delta),
                                           gpu::image(16, *screen.object_z),
                                           gpu::image(17, *screen.room_radiance)};
  dispatch_tiles(list, *pipeline_, bindings, params, screen.tiles->views());
}

}  // namespace lumigraft::relight
