#pragma once
// Irradiance at the vertices of matt objects, which does not depend on the camera.
// gather: all light except lamps (thesis eq. 5.23-5.24), computed once for a room, its lamps and the objects; in: all
// volumes, the objects' vertices; out: one buffer per object.
// record: adds the lamps; in: two rounds of gather, the distance volumes, the lamp maps; out: of().
#include "relight/passes/dispatch.h"
#include "relight/passes/lamps/lamp_maps.h"
#include "relight/passes/volume/volumes.h"
#include "relight/upload/object_store.h"

namespace lumigraft::relight {

/// Per object: front and back side of every vertex of its simplified mesh.
using VertexLight = std::vector<std::unique_ptr<gpu::Buffer>>;

/// The same with the objects it is for. Buffers may remain from earlier objects.
struct ObjectsLight {
  std::vector<PlacedObject> objects;
  VertexLight light;
};

class ObjectLight {
 public:
  explicit ObjectLight(gpu::Device& device);

  /// Whether no object has a specular part.
  static bool enough_for(const std::vector<PlacedObject>& objects);

  /// Allocates buffers for the objects.
  static void fit(gpu::Device& device, const std::vector<PlacedObject>& objects, VertexLight* light);

  /// `cones`: over the hemisphere of a vertex. `slice`: of the vertices.
  void gather(gpu::CommandList& list, shader::FrameParams params, int cones, Slice slice,
              const std::vector<PlacedObject>& objects, const LampMaps& maps, const Volumes& volumes,
              const VertexLight& gathered) const;
  /// What nothing occludes of the environment, for an object whose light was not gathered yet.
  void unoccluded(gpu::CommandList& list, shader::FrameParams params, const PlacedObject& object,
                  const gpu::Buffer& gathered) const;
  /// `newer_weight`: blend weight of the newer round; below 1 the older round is blended in. Both: a buffer per object.
  void record(gpu::Device& device, gpu::CommandList& list, shader::FrameParams params,
              const std::vector<const gpu::Buffer*>& older, const std::vector<const gpu::Buffer*>& newer,
              float newer_weight, const std::vector<PlacedObject>& objects, const LampMaps& maps,
              const Volumes& volumes);
  const gpu::Buffer& of(std::size_t object) const { return *light_[object]; }

 private:
  std::unique_ptr<gpu::ComputePipeline> gather_, unoccluded_, light_up_;
  VertexLight light_;
};

}  // namespace lumigraft::relight
