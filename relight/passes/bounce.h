#pragma once
// Bounces beyond the first, gathered at the voxels near surfaces. In: listed, every volume. Out: gathered_virtual,
// gathered_real.
#include "relight/passes/dispatch.h"
#include "relight/passes/volumes.h"

namespace lumigraft {

class Bounce {
 public:
  explicit Bounce(gpu::Device& device);
  /// `least_share` is how much of the hemisphere the objects must fill for a real voxel to gather.
  void record(gpu::CommandList& list, shader::FrameParams params, float least_share, const Volumes& volumes) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> virtual_, real_;
};

}  // namespace lumigraft
