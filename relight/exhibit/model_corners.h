#pragma once
// Triangles while a model is being read: every corner has its own attributes, not shared yet.
#include <Eigen/Core>
#include <span>

namespace lumigraft::relight {

/// Plain floats without padding: corners with equal bytes are merged to vertices.
struct Corner {
  Eigen::Vector3f position_m;
  Eigen::Vector3f normal;  ///< unit; zero if the file has none
  Eigen::Vector2f texcoord;
  Eigen::Vector3f color;
};
static_assert(sizeof(Corner) == 11 * sizeof(float));

/// Replaces zero normals. Three corners per triangle, no triangle of zero area. A corner's normal is the mean of the
/// faces around its position, weighted by their angle there (Thürmer & Wüthrich 1998, "Computing Vertex Normals from
/// Polygonal Facets"), restricted to faces within 60° of its own face: edges of boxes stay sharp.
void fill_missing_normals(std::span<Corner> corners);

}  // namespace lumigraft::relight
