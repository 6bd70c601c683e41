#pragma once
// A wide lamp is several pieces in the illumination. They are merged before the lamp's position is estimated, and take
// the result afterwards.
#include <vector>

#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

/// Sets the distance of a light from the probe, and with it position, intensity and radius.
void set_distance(PointLight& light, float distance_m, const Eigen::Vector3f& probe_m);

/// Places a piece of a lamp as that is placed: on the plane of a flat one, else, or where its direction misses the
/// plane, at its distance.
void place_as(PointLight& piece, const PointLight& lamp, const Eigen::Vector3f& probe_m);

/// Merges the pieces of each region (PointLight::region) at the place of the first, with the smallest of their ids:
/// which piece is the brightest changes with noise.
std::vector<PointLight> merge_pieces(const std::vector<PointLight>& pieces);

/// Gives the pieces the position and power that were estimated for their lamps. `joined` is merge_pieces(pieces),
/// `placed` the same lamps after the estimate. Each keeps its fraction of the lamp's irradiance.
std::vector<PointLight> place_pieces(const std::vector<PointLight>& pieces, const std::vector<PointLight>& joined,
                                     const std::vector<PointLight>& placed, const Eigen::Vector3f& probe_m);

}  // namespace lumigraft::reconstruct
