#pragma once
// Which voxels lie near surfaces. In: real_distance, virtual_distance. Out: listed.
#include "relight/passes/dispatch.h"
#include "relight/passes/volumes.h"

namespace lumigraft {

class VoxelList {
 public:
  explicit VoxelList(gpu::Device& device);
  void record(gpu::CommandList& list, const shader::FrameParams& params, const Volumes& volumes) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> pipeline_;
};

}  // namespace lumigraft
