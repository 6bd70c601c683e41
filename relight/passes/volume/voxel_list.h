#pragma once
// Lists the voxels near surfaces, so that expensive passes run on these only.
// near_real: in: real_distance as resampled by RealFill; out: listed_real, marks of real_chunks.
// near_virtual: in: virtual_distance; out: listed_virtual, marks of virtual_chunks.
// The chunks exist after Volumes::fit_chunks.
#include "relight/passes/dispatch.h"
#include "relight/passes/volume/volumes.h"

namespace lumigraft::relight {

class VoxelList {
 public:
  explicit VoxelList(gpu::Device& device);
  void near_real(gpu::CommandList& list, const shader::FrameParams& params, const Volumes& volumes) const;
  void near_virtual(gpu::CommandList& list, const shader::FrameParams& params, const Volumes& volumes) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> real_, virtual_;
};

}  // namespace lumigraft::relight
