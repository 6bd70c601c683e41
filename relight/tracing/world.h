#pragma once
// A scene ready for rays. Immutable, shared by threads.
#include <memory>
#include <vector>

#include "relight/tracing/meshes.h"
#include "relight/tracing/sky.h"

namespace lumigraft::relight {

/// A sphere around something that changes light.
struct ChangeRegion {
  Eigen::Vector3f centre_m;
  float radius_m = 0;
  float share = 0;  ///< of the rays that look for places
};

/// Around the objects, and for each lamp around where their shadows lie on the real room.
std::vector<ChangeRegion> change_regions(const std::vector<ReferenceLamp>& lamps, const Meshes& real,
                                         const Meshes& objects);

struct TraceWorld {
  explicit TraceWorld(std::shared_ptr<const ReferenceScene> the_scene);

  std::shared_ptr<const ReferenceScene> scene;
  Meshes real, objects;
  Sky sky;
  /// A guess at where looking pays: no picture depends on it but for its noise.
  std::vector<ChangeRegion> places;
};

}  // namespace lumigraft::relight
