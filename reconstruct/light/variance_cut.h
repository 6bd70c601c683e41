#pragma once
// Wide light cut into several lamps.
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "reconstruct/light/fisheye_rays.h"

namespace lumigraft::reconstruct {

/// Energy that a pixel gives to a lamp: L dω per channel, W/m².
struct PixelEnergy {
  std::uint32_t pixel;
  Eigen::Vector3f energy;
};

/// Variance cut (Viriyothai & Debevec 2009, "Variance Minimization Light Probe Sampling"): the part with the largest
/// variance is cut in two where the sum of the two variances is least, until there are `parts`. Done on the sphere,
/// across a part's principal axis, in place of the paper's axis-aligned cuts of the latitude-longitude picture.
std::vector<std::vector<PixelEnergy>> variance_cut(std::vector<PixelEnergy> pixels, const FisheyeView& view, int parts);

}  // namespace lumigraft::reconstruct
