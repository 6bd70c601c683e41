#pragma once
// A fish-eye radiance picture split into lamps and the rest: picture = lamps + rest, exactly.
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "capture/image.h"
#include "reconstruct/light/fisheye_rays.h"

namespace lumigraft::reconstruct {

struct Lamp {
  Eigen::Vector3f direction;   ///< unit, tag frame; centroid of the energy
  Eigen::Vector3f irradiance;  ///< Σ L dω over the lamp, above what surrounds it, per channel
  float solid_angle_sr = 0;
  bool clipped = false;
  float squareness = 0;  ///< |E z⁴| / E|z|⁴ of the outline, spread made equal in both directions: 0 for an
                         ///< ellipse, 0.43 for a parallelogram
  int region = -1;       ///< the same for what was cut from one region; -1 where nothing was cut
};

struct LightSplit {
  std::vector<Lamp> lamps;     ///< strongest first
  capture::Image<float> rest;  ///< the picture with the lamps' holes filled from around them
};

/// Lamps are compact regions with a sharp edge that stand well above what surrounds them; bright regions too wide for
/// one lamp, and a environment that is still concentrated, are cut into several. At most `max_lamps`, none that carries
/// less than 1 % of the lamps' energy. `clipped` has one channel, non-zero where the radiance is a lower bound.
LightSplit split_lamps(const capture::Image<float>& radiance, const capture::Image<std::uint8_t>& clipped,
                       const FisheyeView& view, int max_lamps);

}  // namespace lumigraft::reconstruct
