#pragma once
// Which voxels lie near surfaces, so that costly passes run over them alone. near_real: in: real_distance as RealFill
// resampled it; out: listed_real, marks of real_chunks. near_virtual: in: virtual_distance; out: listed_virtual, marks
// of virtual_chunks. The chunks are there after Volumes::fit_chunks.
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
