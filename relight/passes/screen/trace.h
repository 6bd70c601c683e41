#pragma once
// Light on real surfaces at 1/scale of the image.
// trace: indirect change (thesis eq. 5.21); in: all volumes, real_position, real_normal, object_surface; out: traced.
// upsample: joint bilateral filter guided by the real surface, from 1/scale (or full size) to full size; in: an image
// at 1/scale, real_position, real_normal; out: the filtered image.
#include "relight/passes/dispatch.h"
#include "relight/passes/screen/screen.h"
#include "relight/passes/volume/volumes.h"

namespace lumigraft::relight {

class Trace {
 public:
  explicit Trace(gpu::Device& device);
  void trace(gpu::CommandList& list, shader::FrameParams params, int change_cones, const Volumes& volumes,
             const Screen& screen) const;
  void upsample(gpu::CommandList& list, shader::FrameParams params, const Screen& screen, const TileList& tiles,
                const gpu::Texture& coarse, const gpu::Texture& smooth, int scale, int window) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> trace_, upsample_;
};

}  // namespace lumigraft::relight
