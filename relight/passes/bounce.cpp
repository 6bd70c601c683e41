#include "relight/passes/bounce.h"

namespace lumigraft {

Bounce::Bounce(gpu::Device& device)
    : virtual_(device.create_compute("bounce_virtual.comp")), real_(device.create_compute("bounce_real.comp")) {}

void Bounce::record(gpu::CommandList& list, shader::FrameParams params, float least_share,
                    const Volumes& volumes) const {
  list.dispatch(*virtual_,
                joined(volumes.bindings(), {gpu::storage(28, *volumes.listed),
                                            gpu::sampled(17, *volumes.virtual_color, gpu::Filter::linear),
                                            gpu::image(18, *volumes.gathered_virtual)}),
                gpu::bytes_of(params), kListGroups);
  params.pass_f.x() = least_share;
  list.dispatch(
      *real_,
      joined(volumes.bindings(), {gpu::storage(28, *volumes.listed), gpu::image(18, *volumes.gathered_real),
                                  gpu::image(25, *volumes.real_albedo), gpu::image(26, *volumes.real_normal)}),
      gpu::bytes_of(params), kListGroups);
}

}  // namespace lumigraft
