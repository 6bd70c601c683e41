#pragma once
// A scene ready for rays. Immutable, shared by threads.
#include <memory>
#include <vector>

#include "relight/reference/meshes.h"
#include "relight/reference/sky.h"

namespace lumigraft::reference {

/// A sphere around something that changes light.
struct Place {
  Eigen::Vector3f centre_m;
  float radius_m = 0;
  float share = 0;  ///< of the rays that look for places
};

struct World {
  explicit World(std::shared_ptr<const ReferenceScene> the_scene);

  std::shared_ptr<const ReferenceScene> scene;
  Meshes real, objects;
  Sky sky;
  /// The objects themselves, and for each lamp where their shadows lie. A guess at where looking pays: no picture
  /// depends on it but for its noise.
  std::vector<Place> places;
};

}  // namespace lumigraft::reference
