#pragma once
// Triangles of the mesh that a [[real_surface]] of the session names.
#include <Eigen/Core>
#include <array>
#include <vector>

#include "capture/session/session.h"

namespace lumigraft::reconstruct {

using SurfaceTriangle = std::array<Eigen::Vector3f, 3>;

/// Vertices in metres in the tag frame, as in the file. Throws InputError.
std::vector<SurfaceTriangle> read_triangles(const capture::RealSurface& surface);

}  // namespace lumigraft::reconstruct
