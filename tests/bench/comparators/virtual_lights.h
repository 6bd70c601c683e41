#pragma once
// Instant radiosity (Keller 1997): light paths create virtual point lights at every surface hit. For the difference of
// two scenes (Knecht et al. 2010) each path is traced in both with the same random numbers, so that the lights are
// equal as long as no object is hit.
#include <optional>
#include <vector>

#include "relight/tracing/world.h"

namespace lumigraft::comparators {

/// Lambertian: radiant intensity is proportional to the cosine to the normal.
struct VirtualLight {
  Eigen::Vector3f position_m = Eigen::Vector3f::Zero(), normal = Eigen::Vector3f::UnitZ();
  relight::Rgb intensity = relight::Rgb::Zero();  ///< along the normal, W/sr

  bool operator==(const VirtualLight& o) const {
    return position_m == o.position_m && normal == o.normal && (intensity == o.intensity).all();
  }
};

/// The same vertex of the same path, in the room alone and with the objects; empty where the path has already ended.
struct LightPair {
  std::optional<VirtualLight> without, with;
};

/// Traces `paths` light paths of up to `bounces` vertices. Lamps and sky start paths in proportion to their power, half
/// of them towards the objects; the sky's power is that on the bounding sphere of the scene. Mirrors create no lights:
/// paths continue from their Lambert part only.
std::vector<LightPair> trace_virtual_lights(const relight::TraceWorld& world, int paths, int bounces,
                                            std::uint32_t seed);

}  // namespace lumigraft::comparators
