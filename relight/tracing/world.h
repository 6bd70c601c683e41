#pragma once
// A scene prepared for ray tracing. Immutable, shared by threads.
#include <memory>
#include <vector>

#include "relight/tracing/emitters.h"
#include "relight/tracing/sky.h"

namespace lumigraft::relight {

/// Bounding sphere of something that changes light.
struct ChangeRegion {
  Eigen::Vector3f centre_m;
  float radius_m = 0;
  float fraction = 0;  ///< fraction of the rays aimed at regions
};

/// Around the objects, and per lamp around their shadows on the real room.
std::vector<ChangeRegion> change_regions(const std::vector<ReferenceLamp>& lamps, const Meshes& real,
                                         const Meshes& objects);

struct TraceWorld {
  explicit TraceWorld(std::shared_ptr<const ReferenceScene> the_scene);

  std::shared_ptr<const ReferenceScene> scene;
  Meshes real, objects;
  bool any_unlit;     ///< of the objects
  Emitters emitters;  ///< of the objects
  Sky sky;
  /// Used for importance sampling only: affects noise, not the expected result.
  std::vector<ChangeRegion> places;

  /// Fraction of a lamp's light that arrives at a point past what moved (ReferenceScene::shadows).
  float open(std::size_t lamp, const Eigen::Vector3f& p_m) const {
    return shadows.empty() || !shadows[lamp] ? 1 : shadows[lamp]->open_at(p_m);
  }
  std::vector<const reconstruct::LampShadow*> shadows;  ///< by lamp; empty: none
};

}  // namespace lumigraft::relight
