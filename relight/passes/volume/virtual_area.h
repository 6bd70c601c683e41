#pragma once
// Area of virtual surfaces per voxel. In: objects' surface samples, virtual_distance. Out: virtual_area.
#include "relight/passes/dispatch.h"
#include "relight/passes/volume/volumes.h"
#include "relight/upload/object_store.h"

namespace lumigraft::relight {

class VirtualArea {
 public:
  static constexpr float kUnitsPerFace = 65536.0f;  ///< fixed point; a voxel overflows only after thousands of faces

  explicit VirtualArea(gpu::Device& device);
  void record(gpu::CommandList& list, shader::FrameParams params, const std::vector<PlacedObject>& objects,
              const Volumes& volumes) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> pipeline_;
};

}  // namespace lumigraft::relight
