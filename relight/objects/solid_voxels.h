#pragma once
// Determines which parts of a model enclose space, and the voxels inside them. Private to the object field.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "relight/exhibit/exhibit.h"

namespace lumigraft::relight {

/// A component is a set of triangles connected by vertices at equal positions. Its boundary is the set of directed
/// edges without an opposite edge; each connected piece of boundary is closed by a triangle fan to its centroid. If
/// these fans are at most 5 % of the component's area (the holes of a scan; none if it is closed), it is a solid, fans
/// included; otherwise it is a shell.
///
/// Inside means that the winding number of all solids together is not zero: parts may overlap, nest, or be inside out,
/// and a hollow modelled by an inner surface stays hollow.
class ObjectSolid {
 public:
  explicit ObjectSolid(const Model& model);

  std::uint32_t component(std::uint32_t triangle) const { return component_of_triangle_[triangle]; }
  bool is_solid(std::uint32_t component) const { return components_[component].solid; }
  /// +1 if the component's normals point outwards, -1 if it is inside out.
  float orientation(std::uint32_t component) const { return components_[component].orientation; }

  /// 1 for each voxel centre origin_m + voxel_m (i, j, k) inside; index i + nx (j + ny k).
  std::vector<std::uint8_t> inside(const std::array<int, 3>& size, const Eigen::Vector3f& origin_m,
                                   float voxel_m) const;

 private:
  struct Component {
    double area_m2 = 0, cone_area_m2 = 0, volume_m3 = 0;
    bool solid = false;
    float orientation = 1.0f;
  };
  using Triangle = std::array<Eigen::Vector3f, 3>;
  std::vector<std::uint32_t> component_of_triangle_;
  std::vector<Component> components_;
  std::vector<Triangle> closed_;  ///< triangles and fans of all solids
};

}  // namespace lumigraft::relight
