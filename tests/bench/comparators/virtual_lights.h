#pragma once
// Instant radiosity (Keller 1997): light paths leave virtual point lights wherever they meet a surface. For the
// difference of two scenes (Knecht et al. 2010) each path is traced in both with the same random numbers, so that the
// lights are the same as long as no object is in the way.
#include <optional>
#include <vector>

#include "relight/tracing/world.h"

namespace lumigraft::comparators {

/// Lambert: radiant intensity falls with the cosine to the normal.
struct VirtualLight {
  Eigen::Vector3f position_m = Eigen::Vector3f::Zero(), normal = Eigen::Vector3f::UnitZ();
  relight::Rgb intensity = relight::Rgb::Zero();  ///< along the normal, W/sr

  bool operator==(const VirtualLight& o) const {
    return position_m == o.position_m && normal == o.normal && (intensity == o.intensity).all();
  }
};

/// The same vertex of the same path, in the room alone and with the objects; empty where the path has ended before.
struct LightPair {
  std::optional<VirtualLight> without, with;
};

/// `paths` light paths of up to `bounces` vertices each. Lamps and sky start paths in proportion to their power, half
/// of them towards the objects; of the sky, what falls on the sphere around everything counts. Mirrors start no lights:
/// paths go on as from their Lambert part alone.
std::vector<LightPair> trace_virtual_lights(const relight::TraceWorld& world, int paths, int bounces,
                                            std::uint32_t seed);

}  // namespace lumigraft::comparators
