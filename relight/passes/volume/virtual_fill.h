#pragma once
// Merges the distance fields of all virtual objects into one volume. In: each object's own field and pose. Out:
// virtual_distance, virtual_reflectance.
#include "relight/passes/dispatch.h"
#include "relight/passes/volume/volumes.h"
#include "relight/upload/object_store.h"

namespace lumigraft::relight {

class VirtualFill {
 public:
  explicit VirtualFill(gpu::Device& device);
  /// Uploads the objects' poses at once, before the list runs.
  void record(gpu::Device& device, gpu::CommandList& list, shader::FrameParams params,
              const std::vector<PlacedObject>& objects, const Volumes& volumes);

 private:
  std::unique_ptr<gpu::ComputePipeline> pipeline_;
  std::vector<std::unique_ptr<gpu::Buffer>> places_;
};

}  // namespace lumigraft::relight
