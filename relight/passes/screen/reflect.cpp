#include "relight/passes/screen/reflect.h"

#include "relight/passes/parameters.h"

namespace lumigraft::relight {

Reflect::Reflect(gpu::Device& device)
    : trace_(device.create_compute("reflect.comp")), smooth_(device.create_compute("mirror_smooth.comp")) {}

void Reflect::record(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes,
                     const Screen& screen) const {
  const std::vector<gpu::Binding> bindings =
      joined(volumes.bindings(), {gpu::sampled(12, *screen.real_position), gpu::sampled(13, *screen.real_normal),
                                  gpu::sampled(14, *screen.real_albedo), gpu::sampled(15, *screen.object_surface),
                                  gpu::sampled(25, *screen.mirror_lost), gpu::sampled(17, *screen.mirror_all),
                                  gpu::sampled(26, *screen.radiance), gpu::image(18, *screen.mirror_gained),
                                  gpu::image(19, *screen.mirror_fraction)});
  // Blocks of the coarse list overlap those of the fine one, which run later and overwrite.
  params.pass_i.x() = kPasses.blurred_px;
  dispatch_tiles(list, *trace_, bindings, params, screen.tiles->blurred());
  params.pass_i.x() = 1;
  dispatch_tiles(list, *trace_, bindings, params, screen.tiles->sharp());
  dispatch_tiles(list, *smooth_,
                 joined(volumes.bindings(),
                        {gpu::sampled(12, *screen.real_position), gpu::sampled(13, *screen.real_normal),
                         gpu::sampled(14, *screen.real_albedo), gpu::sampled(15, *screen.mirror_gained),
                         gpu::sampled(17, *screen.mirror_fraction), gpu::image(18, *screen.mirror_gained_smooth),
                         gpu::image(19, *screen.mirror_fraction_smooth)}),
                 params, screen.tiles->glossy());
}

}  // namespace lumigraft::relight
