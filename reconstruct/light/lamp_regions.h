#pragma once
// Regions of the fish-eye image that are candidates for lamps.
#include <cstdint>
#include <vector>

#include "capture/image.h"
#include "reconstruct/light/fisheye_rays.h"

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

/// Smaller over larger principal width of the region on the sphere; 1 for a disk.
float roundness(const Pixels& region, const FisheyeView& view);

}  // namespace lumigraft::reconstruct
