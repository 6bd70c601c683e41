#pragma once
// A mesh as a signed distance field around its surface.
#include <vector>

#include "reconstruct/field/distance_field.h"
#include "reconstruct/field/real_surface_mesh.h"

namespace lumigraft::reconstruct {

/// Distances to the nearest triangle within `band_m`, free on the side its corners turn about (counter-clockwise). What
/// lies beyond the edge of an open mesh is unknown.
DistanceField field_of(const std::vector<SurfaceTriangle>& triangles, float voxel_m, float band_m);

}  // namespace lumigraft::reconstruct
