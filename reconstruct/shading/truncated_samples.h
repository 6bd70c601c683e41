#pragma once
// Samples of which clipping took the brightest part.
#include <vector>

#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

/// Whether a part of the surface at and around each sample clips in all frames. What was measured there is the darker
/// part of its texture (a truncated sample, Tobin 1958): the brighter the light, the darker it seems.
std::vector<bool> truncated_samples(const DistanceField& field, const Surface& surface);

}  // namespace lumigraft::reconstruct
