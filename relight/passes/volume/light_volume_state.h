#pragma once
// The light volumes of a room and the inputs they were computed from.
#include <memory>
#include <optional>
#include <vector>

#include "reconstruct/scene.h"
#include "relight/objects/placement.h"
#include "relight/passes/volume/object_light.h"
#include "relight/passes/volume/volumes.h"
#include "relight/plan.h"
#include "relight/upload/object_store.h"

namespace lumigraft::relight {

/// The part of a room that the surfaces in the volumes depend on.
struct RealKey {
  shader::vec4 cascade[shader::kCascades];
  std::shared_ptr<const reconstruct::DistanceField> field;
  std::shared_ptr<const reconstruct::AlbedoField> albedo;

  bool operator==(const RealKey&) const = default;
};

/// All inputs of the light volumes.
struct LightKey {
  std::vector<PlacedObject> objects;
  Placement placement;
  std::shared_ptr<const reconstruct::Illumination> illumination;
  std::shared_ptr<const reconstruct::Enclosure> enclosure;
  std::shared_ptr<const reconstruct::DistanceField> field;
  std::shared_ptr<const reconstruct::AlbedoField> albedo;
  Plan plan;

  RealKey real() const { return {{placement.cascade[0], placement.cascade[1]}, field, albedo}; }
  bool operator==(const LightKey& o) const {
    return objects == o.objects && placement == o.placement && illumination == o.illumination &&
           enclosure == o.enclosure && field == o.field && albedo == o.albedo && same_light(plan, o.plan);
  }
  static bool same_light(const Plan& a, const Plan& b) {
    return a.method == b.method && a.volume == b.volume && a.trace_scale == b.trace_scale &&
           a.in_cells() == b.in_cells() && a.rsm == b.rsm && a.max_lights == b.max_lights && a.sh_bands == b.sh_bands &&
           a.bounces == b.bounces && a.lpv_steps == b.lpv_steps && a.quality == b.quality;
  }
};

struct LightVolumeState {
  Volumes volumes;
  std::optional<LightKey> lit;   ///< empty: the volumes hold no light yet
  std::optional<RealKey> real;   ///< empty: the volumes hold no surfaces yet
  shader::FrameParams params{};  ///< parameters of the last fill
  ObjectsLight gathered;         ///< light at the objects' vertices; live setting only

  LightVolumeState(gpu::Device& device, int edge_voxels) : volumes(device, edge_voxels) {}
};

}  // namespace lumigraft::relight
