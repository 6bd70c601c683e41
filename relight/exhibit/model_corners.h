#pragma once
// Triangles while a model is being read: every corner has its own attributes, not shared yet.
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <span>

namespace lumigraft::relight {

/// Without padding: corners with equal bytes are merged to vertices.
struct Corner {
  Eigen::Vector3f position_m = Eigen::Vector3f::Zero();
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< unit; zero if the file has none
  std::array<Eigen::Vector2f, 2> texcoords = {Eigen::Vector2f::Zero(), Eigen::Vector2f::Zero()};  ///< of both sets
  Eigen::Vector3f color = Eigen::Vector3f::Ones();
  Eigen::Vector3f tangent = Eigen::Vector3f::Zero();  ///< unit; zero if the file has none
  float handedness = 0;                               ///< of the tangent: 1 or -1, as in Model::tangents
  std::uint32_t source = kNoSource;                   ///< as in Model::sources

  static constexpr std::uint32_t kNoSource = ~0u;  ///< of a model without animation
};
static_assert(sizeof(Corner) == 17 * sizeof(float) + sizeof(std::uint32_t));

/// Takes corners of a mesh to the model's frame.
class CornerTransform {
 public:
  explicit CornerTransform(const Eigen::Affine3f& T_model_mesh);

  /// Without negative zeros, so that equal values have equal bytes. Normals and tangents without a length become zero.
  Corner operator()(const Corner& corner) const;
  /// Whether triangles must be traversed in the other direction to keep their front.
  bool mirrors() const { return mirrors_; }

 private:
  Eigen::Affine3f T_model_mesh_;
  Eigen::Matrix3f normal_matrix_;  ///< inverse transpose, times a positive factor
  bool mirrors_;
};

/// Whether a triangle has an area, and all of it is finite, with texture coordinates that floats resolve.
bool is_usable(const Corner& a, const Corner& b, const Corner& c);

/// Replaces zero normals. Three corners per triangle, no triangle of zero area. A corner's normal is the mean of the
/// faces around its position, weighted by their angle there (Thürmer & Wüthrich 1998, "Computing Vertex Normals from
/// Polygonal Facets"), restricted to faces within 60° of its own face: edges of boxes stay sharp.
void fill_missing_normals(std::span<Corner> corners);

}  // namespace lumigraft::relight
