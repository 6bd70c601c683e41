#pragma once
// The surfaces in the volumes: distances in both cascades and lists of the voxels near surfaces, so that expensive
// passes run on these only, and what these voxels hold. Their chunks exist after Volumes::fit_chunks. real_distances:
// resamples the fused field; in: the bricks (BrickPool); out: real_distance, listed_real, marks of real_chunks.
// real_surfaces: in: the bricks, listed_real; out: real_distance (made Euclidean near the surface), real_radiance level
// 0, real_albedo, real_normal, real_response.
// virtual_distances: merges the distance fields of all virtual objects into one volume; in: each object's own field and
// pose; out: virtual_distance, virtual_reflectance, listed_virtual, marks of virtual_chunks.
// virtual_areas: area of surface per voxel; in: the objects' surface samples, virtual_distance; out: virtual_area.
#include "relight/passes/dispatch.h"
#include "relight/passes/volume/volumes.h"
#include "relight/upload/brick_pool.h"
#include "relight/upload/object_store.h"

namespace lumigraft::relight {

class SurfaceFill {
 public:
  static constexpr float kUnitsPerFace = 65536.0f;  ///< fixed point; a voxel overflows only after thousands of faces

  explicit SurfaceFill(gpu::Device& device);
  /// `slice`: of the volumes' layers.
  void real_distances(gpu::CommandList& list, shader::FrameParams params, Slice slice, const BrickPool& bricks,
                      const Volumes& volumes) const;
  /// `slice`: of the listed voxels.
  void real_surfaces(gpu::CommandList& list, const shader::FrameParams& params, Slice slice, const BrickPool& bricks,
                     const Volumes& volumes) const;
  /// Uploads the objects' poses at once, before the list runs.
  void virtual_distances(gpu::Device& device, gpu::CommandList& list, shader::FrameParams params,
                         const std::vector<PlacedObject>& objects, const Volumes& volumes);
  void virtual_areas(gpu::CommandList& list, shader::FrameParams params, const std::vector<PlacedObject>& objects,
                     const Volumes& volumes) const;

 private:
  std::unique_ptr<gpu::ComputePipeline> real_distances_, real_list_, surfaces_;
  std::unique_ptr<gpu::ComputePipeline> virtual_distances_, virtual_list_, areas_;
  std::vector<std::unique_ptr<gpu::Buffer>> places_;
};

}  // namespace lumigraft::relight
