#pragma once
// Conversion of a triangle mesh into a signed distance field.
#include <vector>

#include "reconstruct/field/distance_field.h"
#include "reconstruct/field/real_surface_mesh.h"

namespace lumigraft::reconstruct {

/// Signed distances to the nearest triangle, up to `band_m`. Positive on the side from which its corners are in
/// counter-clockwise order. Points beyond the border of an open mesh stay unknown.
DistanceField field_of(const std::vector<SurfaceTriangle>& triangles, float voxel_m, float band_m);

}  // namespace lumigraft::reconstruct
