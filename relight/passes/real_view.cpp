#include "relight/passes/real_view.h"

namespace lumigraft {

RealView::RealView(gpu::Device& device) : pipeline_(device.create_compute("real_gbuffer.comp")) {}

void RealView::record(gpu::CommandList& list, shader::FrameParams params, float least_codes, const BrickPool& bricks,
                      const Screen& screen) const {
  params.pass_f.x() = least_codes;
  dispatch_tiles(list, *pipeline_,
                 joined(bricks.bindings(), {gpu::sampled(1, *screen.rays), gpu::sampled(2, *screen.depth),
                                            gpu::sampled(3, *screen.radiance), gpu::sampled(4, *screen.known_depth),
                                            gpu::image(12, *screen.real_position), gpu::image(13, *screen.real_normal),
                                            gpu::image(14, *screen.real_albedo)}),
                 params, screen.tiles->views());
}

}  // namespace lumigraft
