#pragma once
// Resamples the fused field into both cascades.
// distances: in: the bricks (BrickPool); out: real_distance.
// surfaces: in: the bricks, listed_real; out: real_distance (made Euclidean near the surface), real_radiance level 0,
// real_albedo, real_normal, real_response.
#include "relight/passes/dispatch.h"
#include "relight/passes/volume/volumes.h"
#include "relight/upload/brick_pool.h"

namespace lumigraft::relight {

class RealFill {
 public:
  explicit RealFill(gpu::Device& device);
  void distances(gpu::CommandList& list, const shader::FrameParams& params, const BrickPool& bricks,
                 const Volumes& volumes) const;
  void surfaces(gpu::CommandList& list, const shader::FrameParams& params, const BrickPool& bricks,
                const Volumes& volumes) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> distances_, surfaces_;
};

}  // namespace lumigraft::relight
