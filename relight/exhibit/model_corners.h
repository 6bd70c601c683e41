#pragma once
// Triangles while a model is read: every corner carries its own attributes, nothing is shared yet.
#include <Eigen/Core>
#include <span>

namespace lumigraft::relight {

/// Plain floats without padding: corners are joined into vertices where their bytes are equal.
struct Corner {
  Eigen::Vector3f position_m;
  Eigen::Vector3f normal;  ///< unit; zero where the file has none
  Eigen::Vector2f texcoord;
  Eigen::Vector3f color;
};
static_assert(sizeof(Corner) == 11 * sizeof(float));

/// Replaces zero normals. Three corners per triangle, no triangle without area. A corner's normal is the mean of the
/// faces around its position, weighted by their angle there (Thürmer & Wüthrich 1998, "Computing Vertex Normals from
/// Polygonal Facets"), of those faces alone that lie within 60° of its own: edges of boxes stay sharp.
void fill_missing_normals(std::span<Corner> corners);

}  // namespace lumigraft::relight
