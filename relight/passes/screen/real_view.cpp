#include "relight/passes/screen/real_view.h"

namespace lumigraft::relight {
namespace {

std::vector<gpu::Binding> outputs(const Screen& screen) {
  return {gpu::image(12, *screen.real_position), gpu::image(13, *screen.real_normal),
          gpu::image(14, *screen.real_albedo)};
}

}  // namespace

RealView::RealView(gpu::Device& device)
    : bricks_(device.create_compute("real_view_bricks.comp")),
      volumes_(device.create_compute("real_view_volumes.comp")) {}

void RealView::from_bricks(gpu::CommandList& list, shader::FrameParams params, float min_code_change,
                           const BrickPool& bricks, const Screen& screen) const {
  params.pass_f.x() = min_code_change;
  dispatch_tiles(list, *bricks_,
                 joined(joined(bricks.bindings(), outputs(screen)),
                        {gpu::sampled(1, *screen.rays), gpu::sampled(2, *screen.depth),
                         gpu::sampled(3, *screen.radiance), gpu::sampled(4, *screen.known_depth)}),
                 params, screen.tiles->views());
}

void RealView::from_volumes(gpu::CommandList& list, shader::FrameParams params, float min_code_change,
                            const Volumes& volumes, const Screen& screen) const {
  using gpu::Filter;
  params.pass_f.x() = min_code_change;
  const std::vector<gpu::Binding> inputs = joined(
      volumes.bindings(),
      {gpu::sampled(7, *volumes.real_albedo, Filter::linear), gpu::sampled(8, *volumes.real_normal, Filter::linear),
       gpu::sampled(9, *volumes.real_irradiance, Filter::linear), gpu::sampled(25, *screen.rays),
       gpu::sampled(26, *screen.depth), gpu::sampled(27, *screen.radiance), gpu::sampled(28, *screen.known_depth)});
  dispatch_tiles(list, *volumes_, joined(joined(inputs, outputs(screen)), {gpu::image(15, *screen.indirect)}), params,
                 screen.tiles->views());
}

}  // namespace lumigraft::relight
