#pragma once
// The fused field resampled into both cascades. In: the bricks (BrickPool). Out: real_distance, real_radiance level 0,
// real_albedo, real_normal.
#include "relight/brick_pool.h"
#include "relight/passes/dispatch.h"
#include "relight/passes/volumes.h"

namespace lumigraft {

class RealFill {
 public:
  explicit RealFill(gpu::Device& device);
  void record(gpu::CommandList& list, shader::FrameParams params, const BrickPool& bricks,
              const Volumes& volumes) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> pipeline_;
};

}  // namespace lumigraft
