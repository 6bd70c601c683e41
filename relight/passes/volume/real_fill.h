#pragma once
// Resamples the fused field into both cascades, and lists the voxels near surfaces, so that expensive passes run on
// these only. Their chunks exist after Volumes::fit_chunks.
// distances: in: the bricks (BrickPool); out: real_distance, listed_real, marks of real_chunks.
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
  std::unique_ptr<gpu::ComputePipeline> distances_, list_, surfaces_;
};

}  // namespace lumigraft::relight
