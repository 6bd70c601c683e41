#include "relight/passes/volume/voxel_list.h"

namespace lumigraft::relight {

VoxelList::VoxelList(gpu::Device& device)
    : real_(device.create_compute("voxel_list_real.comp")),
      virtual_(device.create_compute("voxel_list_virtual.comp")) {}

void VoxelList::near_real(gpu::CommandList& list, const shader::FrameParams& params, const Volumes& volumes) const {
  const gpu::Buffer& marks = volumes.real_chunks.marks();
  list.fill(*volumes.listed_real, 0);
  list.fill(marks, 0);
  dispatch_3d(list, *real_,
              {gpu::storage(28, *volumes.listed_real), gpu::storage(33, marks), gpu::image(12, *volumes.real_distance)},
              params, volumes.edge, volumes.edge, volumes.edge * shader::kCascades);
}

void VoxelList::near_virtual(gpu::CommandList& list, const shader::FrameParams& params, const Volumes& volumes) const {
  const gpu::Buffer& marks = volumes.virtual_chunks.marks();
  list.fill(*volumes.listed_virtual, 0);
  list.fill(marks, 0);
  dispatch_3d(list, *virtual_,
              {gpu::storage(28, *volumes.listed_virtual), gpu::storage(33, marks),
               gpu::sampled(1, *volumes.virtual_distance, gpu::Filter::linear)},
              params, volumes.edge, volumes.edge, volumes.edge * shader::kCascades);
}

}  // namespace lumigraft::relight
