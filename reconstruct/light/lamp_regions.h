#pragma once
// Regions of the fish-eye image that are candidates for lamps, and the subdivision of a wide one into several lamps.
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "capture/image.h"
#include "reconstruct/light/environment.h"

namespace lumigraft::reconstruct {

using Pixels = std::vector<std::uint32_t>;

/// The connected region around `peak` whose outline hardly depends on the threshold (after the maximally stable
/// extremal regions of Matas et al. 2002). The threshold on `level` falls from the peak to the first value below which
/// the region's solid angle is stable over one octave, and on while it stays stable. Empty if no threshold above
/// `floor` gives a stable outline, as for a soft glow.
Pixels stable_region(const std::vector<float>& level, const FisheyeView& view, std::uint32_t peak, float floor);

/// The connected region of non-zero pixels of `mask` around `seed`.
Pixels connected_region(const std::vector<std::uint8_t>& mask, const FisheyeView& view, std::uint32_t seed);

/// Pixels of the view with from_px < chessboard distance to the region <= to_px.
Pixels ring_around(const Pixels& region, const FisheyeView& view, int from_px, int to_px);

/// A region compared with the rectangle of the same second moments, in the plane that touches the sphere at the
/// region's centre: there tubes and panels are straight.
struct RegionShape {
  double filled;   ///< area over the rectangle's: 1 for rectangles however long, 1.05 for ellipses
  double outline;  ///< length over the rectangle's; long for a ragged region
};
RegionShape shape_of(const Pixels& region, const FisheyeView& view);

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
