#pragma once
// Bounces beyond the first, gathered at surface voxels. list: which voxels; in: virtual_distance, real_radiance,
// real_albedo; out: listed. gather: in: every volume; out: gathered_virtual, gathered_real.
#include "relight/passes/dispatch.h"
#include "relight/passes/volumes.h"

namespace lumigraft {

class Bounce {
 public:
  explicit Bounce(gpu::Device& device);
  /// `least_share` is how much of the hemisphere the objects must fill for a real voxel to be listed.
  void list(gpu::CommandList& list, shader::FrameParams params, float least_share, const Volumes& volumes) const;
  void gather(gpu::CommandList& list, shader::FrameParams params, const Volumes& volumes) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> list_, gather_;
};

}  // namespace lumigraft
