#pragma once
// Light that lamps send through transmissive objects, and that these and smooth metals reflect, to the surfaces around:
// caustics and coloured shadows. Paths of the camera would find lamps by an object only by chance.
//
// A photon starts at a lamp towards such an object, is reflected and refracted by such interfaces alone, and ends where
// it hits another surface, or the body of a transmissive one. This is all light of lamps that arrives there by such
// interfaces; renderers with photons leave it out of their paths.
#include <cstdint>
#include <functional>
#include <vector>

#include "relight/tracing/meshes.h"
#include "relight/tracing/photon_map.h"

namespace lumigraft::relight {

struct PhotonScene {
  const Meshes& real;
  const Meshes& objects;
  const std::vector<ReferenceLamp>& lamps;
  /// Fraction of a lamp's light that the room leaves at a point; w: unit, from there to a point of the lamp, which is
  /// `distance_m` away.
  std::function<float(std::size_t lamp, const Eigen::Vector3f& p_m, const Eigen::Vector3f& w, float distance_m)> open;
  /// Whether opaque surfaces reflect photons: those at a hit, and any of an object. Empty: none do.
  std::function<bool(const MeshHit&)> reflects = {};
  std::function<bool(std::uint32_t mesh)> any_reflects = {};
};

/// Whether there are lamps, and objects towards which photons start.
bool has_photons(const PhotonScene& scene);

/// `count`: emitted photons, divided among lamps and objects by the power between them.
PhotonMap trace_photons(const PhotonScene& scene, int count, std::uint32_t seed);

}  // namespace lumigraft::relight
