#pragma once
// Regions of a fish-eye picture that may be lamps.
#include <cstdint>
#include <vector>

#include "capture/image.h"
#include "reconstruct/light/fisheye_rays.h"

namespace lumigraft::reconstruct {

using Pixels = std::vector<std::uint32_t>;

/// The connected region around `peak` whose outline hardly depends on the threshold (after the maximally stable
/// extremal regions of Matas et al. 2002): grown from the peak by falling level up to the first threshold below which
/// its solid angle stays over one octave, and on from there while it stays. Empty where no threshold above `floor`
/// gives a stable outline: a soft glow.
Pixels stable_region(const std::vector<float>& level, const FisheyeView& view, std::uint32_t peak, float floor);

/// The connected region of pixels that `mask` marks, around `seed`.
Pixels connected_region(const std::vector<std::uint8_t>& mask, const FisheyeView& view, std::uint32_t seed);

/// Seen pixels within `from_px` < distance <= `to_px` (chessboard) of the region.
Pixels ring_around(const Pixels& region, const FisheyeView& view, int from_px, int to_px);

/// Smaller over larger principal width of the region on the sphere, 1 for a disk.
float roundness(const Pixels& region, const FisheyeView& view);

}  // namespace lumigraft::reconstruct
