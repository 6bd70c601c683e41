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

}  // namespace lumigraft::reconstruct
