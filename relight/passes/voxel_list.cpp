#include "relight/passes/voxel_list.h"

namespace lumigraft {

VoxelList::VoxelList(gpu::Device& device) : pipeline_(device.create_compute("voxel_list.comp")) {}

void VoxelList::record(gpu::CommandList& list, const shader::FrameParams& params, const Volumes& volumes) const {
  list.fill(*volumes.listed, 0);
  dispatch_3d(list, *pipeline_,
              {gpu::sampled(1, *volumes.virtual_distance, gpu::Filter::linear), gpu::storage(28, *volumes.listed),
               gpu::image(12, *volumes.real_distance)},
              params, volumes.edge, volumes.edge, volumes.edge * shader::kCascades);
}

}  // namespace lumigraft
