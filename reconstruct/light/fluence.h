#pragma once
// Light that arrives at a place.
#include <Eigen/Core>

#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

/// Mean irradiance over all sides of a small sphere at `position_m` (tag frame), W/m² per channel: lamps that shine, at
/// their distance where it is known, and the environment. Nothing occludes anything.
Eigen::Array3f mean_irradiance(const Illumination& light, const Eigen::Vector3f& position_m);

/// Irradiance of one lamp, if it shines, on a surface, W/m² per channel; nothing occludes it.
Eigen::Array3f lamp_irradiance(const PointLight& lamp, const Eigen::Vector3f& position_m,
                               const Eigen::Vector3f& normal);

/// Irradiance of the environment alone, W/m² per channel; nothing occludes it.
Eigen::Array3f environment_irradiance(const Illumination& light, const Eigen::Vector3f& normal);

/// Of all lamps that shine and the environment, W/m² per channel, on a surface at `position_m` with unit normal
/// `normal` (tag frame). Nothing occludes anything: its ratio under two lights is what a change of light does to the
/// colours of a room, to first order.
Eigen::Array3f unoccluded_irradiance(const Illumination& light, const Eigen::Vector3f& position_m,
                                     const Eigen::Vector3f& normal);

}  // namespace lumigraft::reconstruct
