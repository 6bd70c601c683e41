#include "relight/passes/lpv_propagate.h"

#include <utility>

namespace lumigraft {

LpvPropagate::LpvPropagate(gpu::Device& device) : step_(device.create_compute("lpv_step.comp")) {}

void LpvPropagate::record(gpu::CommandList& list, shader::FrameParams params, int steps, bool go_on,
                          LpvGrid& grid) const {
  params.pass_i.x() = grid.edge;
  for (int i = 0; i < steps; ++i) {
    const LpvGrid::Light& from = i == 0 && !go_on ? grid.source : grid.light;
    dispatch_3d(list, *step_,
                {gpu::image(1, *grid.source[0]), gpu::image(2, *grid.source[1]), gpu::image(3, *grid.source[2]),
                 gpu::image(4, *from[0]), gpu::image(5, *from[1]), gpu::image(6, *from[2]),
                 gpu::image(7, *grid.from_low), gpu::image(8, *grid.from_high), gpu::image(12, *grid.other[0]),
                 gpu::image(13, *grid.other[1]), gpu::image(14, *grid.other[2])},
                params, grid.edge, grid.edge, grid.edge * shader::kCascades);
    std::swap(grid.light, grid.other);
  }
}

}  // namespace lumigraft
