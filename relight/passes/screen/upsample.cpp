#include "relight/passes/screen/upsample.h"

namespace lumigraft::relight {

Upsample::Upsample(gpu::Device& device) : pipeline_(device.create_compute("upsample.comp")) {}

void Upsample::record(gpu::CommandList& list, shader::FrameParams params, const Screen& screen, const TileList& tiles,
                      const gpu::Texture& traced, const gpu::Texture& smooth, int scale, int window) const {
  params.picture.z() = scale;
  params.pass_i.x() = window;
  params.pass_f.x() = 0.7f * static_cast<float>(window) + 0.3f;  // the Gaussian falls to a tenth at the window's edge
  dispatch_tiles(list, *pipeline_,
                 {gpu::sampled(12, *screen.real_position), gpu::sampled(13, *screen.real_normal),
                  gpu::sampled(14, traced), gpu::image(16, smooth)},
                 params, tiles);
}

}  // namespace lumigraft::relight
