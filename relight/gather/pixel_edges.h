#pragma once
// Edges and creases, which a field of voxels rounds off, as sharp as the picture shows them.
#include "relight/gather/gbuffer.h"

namespace lumigraft::relight {

/// Where two planes meet, pixels of the fused surface within about two voxels of the edge turn from one plane into the
/// other, and what a lamp brings there is wrong by the turn. Such pixels take the plane and the albedo of the side that
/// they lie on: that which the pixel's ray meets where the planes cross, or, about as near to it, that which looks more
/// like the pixel. Pixels are left as they are where there aren't two planes beside them: real curves, ends, clutter.
/// `exposure`: radiance times that is what the camera shows, 1 at most.
void sharpen_edges(const PosedCamera& camera, const capture::Image<float>& radiance, float exposure, float voxel_m,
                   std::vector<GBufferPixel>& seen);

}  // namespace lumigraft::relight
