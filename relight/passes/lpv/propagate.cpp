#include "relight/passes/lpv/propagate.h"

namespace lumigraft::relight {

void LpvPropagate::record(gpu::CommandList& list, shader::FrameParams params, int sweeps, bool go_on,
                          const LpvGrid& grid) const {
  params.pass_i.x() = grid.edge;
  if (!go_on) {
    for (const auto& texture : grid.light) list.clear(*texture, {});
  }
  const std::vector<gpu::Binding> bindings{gpu::image(1, *grid.source[0]), gpu::image(2, *grid.source[1]),
                                           gpu::image(3, *grid.source[2]), gpu::image(4, *grid.light[0]),
                                           gpu::image(5, *grid.light[1]),  gpu::image(6, *grid.light[2]),
                                           gpu::image(7, *grid.from_low),  gpu::image(8, *grid.from_high)};
  for (int i = 0; i < 2 * sweeps; ++i) {
    params.pass_i.y() = i % 2;
    dispatch_3d(list, *step_, bindings, params, grid.edge / 2, grid.edge, grid.edge * shader::kCascades);
  }
}

}  // namespace lumigraft::relight
