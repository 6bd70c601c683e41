#include "relight/passes/screen/trace.h"

namespace lumigraft::relight {

Trace::Trace(gpu::Device& device)
    : trace_(device.create_compute("trace.comp")), upsample_(device.create_compute("upsample.comp")) {}

void Trace::trace(gpu::CommandList& list, shader::FrameParams params, int change_cones, const Volumes& volumes,
                  const Screen& screen) const {
  params.pass_i.x() = change_cones;
  dispatch_tiles(
      list, *trace_,
      joined(volumes.bindings(), {gpu::sampled(12, *screen.real_position), gpu::sampled(13, *screen.real_normal),
                                  gpu::sampled(14, *screen.object_surface), gpu::sampled(15, *screen.real_albedo),
                                  gpu::image(16, *screen.traced)}),
      params, screen.tiles->traces());
}

void Trace::upsample(gpu::CommandList& list, shader::FrameParams params, const Screen& screen, const TileList& tiles,
                     const gpu::Texture& coarse, const gpu::Texture& smooth, int scale, int window) const {
  params.picture.z() = scale;
  params.pass_i.x() = window;
  params.pass_f.x() = 0.7f * static_cast<float>(window) + 0.3f;  // the Gaussian falls to a tenth at the window's edge
  dispatch_tiles(list, *upsample_,
                 {gpu::sampled(12, *screen.real_position), gpu::sampled(13, *screen.real_normal),
                  gpu::sampled(14, coarse), gpu::image(16, smooth)},
                 params, tiles);
}

}  // namespace lumigraft::relight
