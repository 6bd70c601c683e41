#pragma once
// Triangles of the mesh that a [[real_surface]] of the session names, and their signed distance field.
#include <array>
#include <vector>

#include "capture/session/session.h"
#include "reconstruct/field/distance_field.h"

namespace lumigraft::reconstruct {

using SurfaceTriangle = std::array<Eigen::Vector3f, 3>;

/// Vertices in metres in the tag frame, as in the file. Throws InputError.
std::vector<SurfaceTriangle> read_triangles(const capture::RealSurface& surface);

/// Signed distances to the nearest triangle, up to `band_m`. Positive on the side from which its corners are in
/// counter-clockwise order. Points beyond the border of an open mesh stay unknown.
DistanceField field_of(const std::vector<SurfaceTriangle>& triangles, float voxel_m, float band_m);

}  // namespace lumigraft::reconstruct
