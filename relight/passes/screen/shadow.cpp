#include "relight/passes/screen/shadow.h"

#include "relight/passes/parameters.h"

namespace lumigraft::relight {
Shadow::Shadow(gpu::Device& device)
    : matt_(device.create_compute("shadow.comp")), glossy_(device.create_compute("shadow_glossy.comp")) {}

void Shadow::record(gpu::CommandList& list, shader::FrameParams params, bool glossy, bool by_mirrors,
                    const LampMaps& maps, const Volumes& volumes, const Screen& screen) const {
  params.pass_i << screen.shadow_scale, by_mirrors ? kPasses.mirror_samples * params.counts.w() : 0, 0, 0;
  std::vector<gpu::Binding> bindings =
      joined(joined(volumes.bindings(), maps.bindings()),
             {gpu::sampled(12, *screen.real_position), gpu::sampled(13, *screen.real_normal),
              gpu::sampled(15, *screen.object_surface),
              gpu::image(16, screen.shadow_scale > 1 ? *screen.shadowed : *screen.direct_lost)});
  if (glossy) {
    bindings = joined(bindings, {gpu::sampled(14, *screen.real_albedo), gpu::image(17, *screen.mirror_lost),
                                 gpu::image(18, *screen.mirror_all)});
  }
  dispatch_tiles(list, glossy ? *glossy_ : *matt_, bindings, params, screen.tiles->shadows());
}

}  // namespace lumigraft::relight
