#pragma once
// A scene ready for rays. Immutable, shared by threads.
#include <memory>
#include <vector>

#include "relight/tracing/meshes.h"
#include "relight/tracing/sky.h"

namespace lumigraft::reference {

/// A sphere around something that changes light.
struct Place {
  Eigen::Vector3f centre_m;
  float radius_m = 0;
  float share = 0;  ///< of the rays that look for places
};

/// Around the objects, and for each lamp around where their shadows lie on the real room.
std::vector<Place> places_of_change(const std::vector<ReferenceLamp>& lamps, const Meshes& real, const Meshes& objects);

struct World {
  explicit World(std::shared_ptr<const ReferenceScene> the_scene);

  std::shared_ptr<const ReferenceScene> scene;
  Meshes real, objects;
  Sky sky;
  /// A guess at where looking pays: no picture depends on it but for its noise.
  std::vector<Place> places;
};

}  // namespace lumigraft::reference
