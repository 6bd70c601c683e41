#pragma once
// Virtual surfaces in the volumes.
// distances: merges the distance fields of all virtual objects into one volume, and lists the voxels near them as
// RealFill does; in: each object's own field and pose; out: virtual_distance, virtual_reflectance, listed_virtual,
// marks of virtual_chunks. areas: area of surface per voxel; in: the objects' surface samples, virtual_distance; out:
// virtual_area.
#include "relight/passes/dispatch.h"
#include "relight/passes/volume/volumes.h"
#include "relight/upload/object_store.h"

namespace lumigraft::relight {

class VirtualFill {
 public:
  static constexpr float kUnitsPerFace = 65536.0f;  ///< fixed point; a voxel overflows only after thousands of faces

  explicit VirtualFill(gpu::Device& device);
  /// Uploads the objects' poses at once, before the list runs.
  void distances(gpu::Device& device, gpu::CommandList& list, shader::FrameParams params,
                 const std::vector<PlacedObject>& objects, const Volumes& volumes);
  void areas(gpu::CommandList& list, shader::FrameParams params, const std::vector<PlacedObject>& objects,
             const Volumes& volumes) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> distances_, list_, areas_;
  std::vector<std::unique_ptr<gpu::Buffer>> places_;
};

}  // namespace lumigraft::relight
