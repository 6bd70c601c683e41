#pragma once
// Triangles of what an operator said about a real surface.
#include <Eigen/Core>
#include <array>
#include <vector>

#include "capture/session/session.h"

namespace lumigraft::reconstruct {

using SurfaceTriangle = std::array<Eigen::Vector3f, 3>;

/// In the frame of the file, which is the tag's. Throws InputError.
std::vector<SurfaceTriangle> read_triangles(const capture::RealSurface& surface);

}  // namespace lumigraft::reconstruct
