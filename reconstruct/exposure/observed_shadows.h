#pragma once
// Shadows of what moved, from places that the colour camera sees again. A place sends the fraction r of what it would
// without them, and the fraction f_k of its irradiance would be that of lamp k, by channel. The hidden fractions d_k of
// the lamps' light minimize
//
//   eᵀ N⁻¹ e + Σ d_k² / w_k² + d² / w²,  e = 1 - r - Σ d_k f_k - d f,  0 <= d_k <= 1
//
// with d that of the rest f of the light, and N the covariance of r: what changes a place otherwise changes its
// brightness more than its colour, so that lamps of different colours are distinguished. Lamps of one colour are not:
// w_k is 1 for lamps whose light passes near something that was not there before, less for those that the fish-eye sees
// covered, and little for others.
#include <Eigen/Core>
#include <memory>
#include <vector>

#include "reconstruct/light/lamp_shadows.h"
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

/// A place that is seen again.
struct ShadowedPlace {
  Eigen::Vector3f position_m;         ///< tag frame
  Eigen::Vector3f normal;             ///< unit, tag frame
  Eigen::Array3f ratio;               ///< r; an upper bound if the place is too dark to be measured
  std::vector<Eigen::Array3f> parts;  ///< f_k of each lamp of the light
};

/// Shadows of the lamps that a person occludes from the fish-eye (PointLight::covered). Those of hands are narrower
/// than the distances between places; depth measures them better. `moved_m`: points on surface that was not there
/// before, tag frame. Null if the places show no shadow.
std::shared_ptr<const LampShadows> observe_shadows(const std::vector<ShadowedPlace>& places,
                                                   const std::vector<Eigen::Vector3f>& moved_m,
                                                   const Illumination& light);

}  // namespace lumigraft::reconstruct
