#pragma once
// Restores sharp edges and creases, which the voxel field rounds off, from the image.
#include "relight/gather/gbuffer.h"

namespace lumigraft::relight {

/// Where two planes meet, the fused normals within about two voxels of the edge turn from one plane to the other, which
/// gives wrong lamp light there. Such pixels get the plane and the albedo of the side they belong to: the side that the
/// pixel's ray hits according to the planes' intersection, or, near it, the side whose colour is more similar. Pixels
/// without two adjacent planes are unchanged: curved surfaces, ends, clutter. `exposure`: camera pixel value over
/// radiance, 1 at most.
void sharpen_edges(const PosedCamera& camera, const capture::Image<float>& radiance, const Rgb& exposure, float voxel_m,
                   std::vector<GBufferPixel>& seen);

}  // namespace lumigraft::relight
