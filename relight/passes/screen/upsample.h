#pragma once
// Joint bilateral filter guided by the real surface, from 1/scale (or full size) to full size. In: a traced image,
// real_position, real_normal. Out: the filtered image.
#include "relight/passes/dispatch.h"
#include "relight/passes/screen/screen.h"

namespace lumigraft::relight {

class Upsample {
 public:
  explicit Upsample(gpu::Device& device);
  void record(gpu::CommandList& list, shader::FrameParams params, const Screen& screen, const TileList& tiles,
              const gpu::Texture& traced, const gpu::Texture& smooth, int scale, int window) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> pipeline_;
};

}  // namespace lumigraft::relight
