#pragma once
// Planes at grazing incidence, distinguished from jumps in depth.
#include <optional>

#include "reconstruct/fusion/depth_preprocess.h"

namespace lumigraft::reconstruct {

/// Depth differs as much between neighbouring pixels of a plane at a grazing angle as across a jump. Inverse depth of a
/// plane is affine in the image, so its slope is the same on both sides of the pixels in question; next to a jump it is
/// nearly zero. Examined in a window around the block of 2 × 2 pixels whose first pixel is (u, v).
/// @return empty if that is no steep plane: a jump, an edge, too little measured, or more difference than noise
/// explains
std::optional<SteepPlane> steep_plane_at(const PreparedDepth& view, int u, int v, float focal,
                                         const capture::DepthNoise& noise);

}  // namespace lumigraft::reconstruct
