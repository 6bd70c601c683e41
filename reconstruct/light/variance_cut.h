#pragma once
// Subdivision of a wide region into several lamps.
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "reconstruct/light/fisheye_rays.h"

namespace lumigraft::reconstruct {

/// Contribution of a pixel to a lamp: L dω per channel, W/m².
struct PixelEnergy {
  std::uint32_t pixel;
  Eigen::Vector3f energy;
};

/// Variance cut (Viriyothai and Debevec 2009, "Variance Minimization Light Probe Sampling"): repeatedly cuts the part
/// with the largest variance where the sum of the two variances is smallest, until there are `parts`. Works on the
/// sphere across a part's principal axis; the paper cuts the latitude-longitude image along its axes.
std::vector<std::vector<PixelEnergy>> variance_cut(std::vector<PixelEnergy> pixels, const FisheyeView& view, int parts);

}  // namespace lumigraft::reconstruct
