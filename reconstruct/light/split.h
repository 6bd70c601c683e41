#pragma once
// Split of a fish-eye radiance image into lamps and a residual image: image = lamps + residual, exactly.
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "capture/image.h"
#include "reconstruct/light/environment.h"

namespace lumigraft::reconstruct {

struct SplitLamp {
  Eigen::Vector3f direction;   ///< unit, tag frame; centroid of the energy
  Eigen::Vector3f irradiance;  ///< Σ L dω over the lamp above its background, per channel
  float solid_angle_sr = 0;
  bool clipped = false;
  float squareness = 0;  ///< |E z⁴| / E|z|⁴ of the whitened outline: ellipse 0, parallelogram 0.43
  /// Conjugate half axes, as tangents, of the ellipse with the outline's second moments and the solid angle; zero if
  /// the lamp is too small for them.
  Eigen::Vector3f outline_u = Eigen::Vector3f::Zero(), outline_v = Eigen::Vector3f::Zero();
  int region = -1;  ///< equal for the parts of one region that was cut; -1 if it was not
};

struct LightSplit {
  std::vector<SplitLamp> lamps;    ///< strongest first
  capture::Image<float> residual;  ///< lamps removed, their pixels filled from the background
};

/// Lamps are compact regions with a sharp edge and a high contrast. Bright regions too wide for one lamp, and a
/// residual that is still concentrated, are cut into several lamps. At most `max_lamps`, each with at least 1 % of the
/// lamps' energy. `clipped` has one channel, non-zero where the radiance is a lower bound.
LightSplit split_lamps(const capture::Image<float>& radiance, const capture::Image<std::uint8_t>& clipped,
                       const FisheyeView& view, int max_lamps);

}  // namespace lumigraft::reconstruct
