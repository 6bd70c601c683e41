#pragma once
// Irradiance on a surface without occlusion: what a change of light does to the colours of a room, to first order.
#include <Eigen/Core>

#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

/// W/m² per channel on a surface at `position_m` with unit normal `normal` (tag frame): all lamps that shine, and the
/// environment. Nothing occludes anything.
Eigen::Array3f unoccluded_irradiance(const Illumination& light, const Eigen::Vector3f& position_m,
                                     const Eigen::Vector3f& normal);

/// Mean irradiance over all sides of a small sphere at the probe, W/m² per channel.
Eigen::Array3f irradiance_around_probe(const Illumination& light);

}  // namespace lumigraft::reconstruct
