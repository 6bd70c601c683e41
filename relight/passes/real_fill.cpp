#include "relight/passes/real_fill.h"

namespace lumigraft {

RealFill::RealFill(gpu::Device& device) : pipeline_(device.create_compute("real_fill.comp")) {}

void RealFill::record(gpu::CommandList& list, shader::FrameParams params, const BrickPool& bricks,
                      const Volumes& volumes) const {
  for (int c = 0; c < shader::kCascades; ++c) {
    params.pass_i.x() = c;
    const auto& out = volumes.cascade[static_cast<std::size_t>(c)];
    dispatch_3d(list, *pipeline_,
                joined(bricks.bindings(), {gpu::image(1, *out.real_distance), gpu::image(2, *out.real_radiance),
                                           gpu::image(3, *out.real_albedo), gpu::image(4, *out.real_normal)}),
                params, volumes.edge, volumes.edge, volumes.edge);
  }
}

}  // namespace lumigraft
