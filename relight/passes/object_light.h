#pragma once
// Irradiance at the vertices of matt objects (thesis eq. 5.23-5.24), which does not depend on the camera: made once for
// a room, its lamps and the objects. In: every volume, the lamp maps, the objects' vertices. Out: a buffer for every
// object.
#include "relight/object_store.h"
#include "relight/passes/dispatch.h"
#include "relight/passes/lamp_maps.h"
#include "relight/passes/volumes.h"

namespace lumigraft {

class ObjectLight {
 public:
  explicit ObjectLight(gpu::Device& device);

  /// Whether no object has a mirror part.
  static bool enough_for(const std::vector<PlacedObject>& objects);

  /// `cones`: over the hemisphere of a vertex.
  void record(gpu::Device& device, gpu::CommandList& list, shader::FrameParams params, int cones,
              const std::vector<PlacedObject>& objects, const LampMaps& maps, const Volumes& volumes);
  /// Of one object: of the front and of the back of every vertex of its simple mesh.
  const gpu::Buffer& of(std::size_t object) const { return *light_[object]; }

 private:
  std::unique_ptr<gpu::ComputePipeline> pipeline_;
  std::vector<std::unique_ptr<gpu::Buffer>> light_;
};

}  // namespace lumigraft
