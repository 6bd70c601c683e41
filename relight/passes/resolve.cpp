#include "relight/passes/resolve.h"

namespace lumigraft {

Resolve::Resolve(gpu::Device& device) : pipeline_(device.create_compute("resolve.comp")) {}

void Resolve::record(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes) const {
  for (int c = 0; c < shader::kCascades; ++c) {
    params.pass_i.x() = c;
    const auto& own = volumes.cascade[static_cast<std::size_t>(c)];
    dispatch_3d(
        list, *pipeline_,
        {gpu::sampled(1, *volumes.virtual_distance, gpu::Filter::linear), gpu::storage(16, *volumes.virtual_flux),
         gpu::storage(17, *volumes.real_flux), gpu::image(18, *own.gathered_virtual),
         gpu::image(19, *own.gathered_real), gpu::image(25, *own.real_radiance), gpu::image(26, *own.virtual_radiance),
         gpu::image(27, *own.real_change)},
        params, volumes.edge, volumes.edge, volumes.edge);
  }
}

}  // namespace lumigraft
