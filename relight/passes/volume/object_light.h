#pragma once
// Irradiance at the vertices of matt objects, which does not depend on the camera. gather: all but the lamps themselves
// (thesis eq. 5.23-5.24), made once for a room, its lamps and the objects; in: every volume, the objects' vertices;
// out: a buffer for every object. record: with the lamps; in: two rounds of gather, the distance volumes, the lamp
// maps; out: of().
#include "relight/passes/dispatch.h"
#include "relight/passes/lamps/lamp_maps.h"
#include "relight/passes/volume/volumes.h"
#include "relight/upload/object_store.h"

namespace lumigraft::relight {

/// Of one object after the other: of the front and of the back of every vertex of its simple mesh.
using VertexLight = std::vector<std::unique_ptr<gpu::Buffer>>;

class ObjectLight {
 public:
  explicit ObjectLight(gpu::Device& device);

  /// Whether no object has a mirror part.
  static bool enough_for(const std::vector<PlacedObject>& objects);

  /// Room for so many objects.
  static void fit(gpu::Device& device, const std::vector<PlacedObject>& objects, VertexLight* light);

  /// `cones`: over the hemisphere of a vertex. `slice`: of the vertices.
  void gather(gpu::CommandList& list, shader::FrameParams params, int cones, Slice slice,
              const std::vector<PlacedObject>& objects, const LampMaps& maps, const Volumes& volumes,
              const VertexLight& gathered) const;
  /// `share`: of the newer round; the older is used up to 1 alone.
  void record(gpu::Device& device, gpu::CommandList& list, shader::FrameParams params, const VertexLight& older,
              const VertexLight& newer, float share, const std::vector<PlacedObject>& objects, const LampMaps& maps,
              const Volumes& volumes);
  const gpu::Buffer& of(std::size_t object) const { return *light_[object]; }

 private:
  std::unique_ptr<gpu::ComputePipeline> gather_, light_up_;
  VertexLight light_;
};

}  // namespace lumigraft::relight
