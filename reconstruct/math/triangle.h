#pragma once
// Points of triangles.
#include <Eigen/Core>

namespace lumigraft::reconstruct {

/// Barycentric weights of the triangle's point nearest to the origin, by the Voronoi region that contains the origin
/// (Ericson 2005, "Real-Time Collision Detection", §5.1.5).
Eigen::Vector3f nearest_to_origin(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c);

}  // namespace lumigraft::reconstruct
