#pragma once
// The real surface at each pixel. In: rays, depth, camera radiance, known materials, and either the bricks or the light
// volumes. Out: real_position, real_normal with the influence mask, real_albedo; from volumes also indirect.
#include "relight/passes/dispatch.h"
#include "relight/passes/screen/screen.h"
#include "relight/passes/volume/volumes.h"
#include "relight/upload/brick_pool.h"

namespace lumigraft::relight {

class RealView {
 public:
  explicit RealView(gpu::Device& device);
  /// Pixels that the objects cannot change by more than `min_code_change` pixel values (8 bit), by a bound that is
  /// conservative by a factor of several, are excluded from the influence mask.
  void from_bricks(gpu::CommandList& list, shader::FrameParams params, float min_code_change, const BrickPool& bricks,
                   const Screen& screen) const;
  void from_volumes(gpu::CommandList& list, shader::FrameParams params, float min_code_change, const Volumes& volumes,
                    const Screen& screen) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> bricks_, volumes_;
};

}  // namespace lumigraft::relight
