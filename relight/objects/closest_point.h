#pragma once
// Closest-point and ray queries on the triangles of a model. Private to the object field.
#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "relight/exhibit/exhibit.h"

namespace lumigraft::relight {

struct ClosestPoint {
  float distance_m = 0;
  std::uint32_t triangle = 0;
  Eigen::Vector3f position_m;
  Eigen::Vector3f barycentric;  ///< barycentric weights of the triangle's three vertices
};

struct EmbreeScene;

class ObjectSurface {
 public:
  explicit ObjectSurface(const Model& model);  ///< keeps a reference
  ~ObjectSurface();

  /// Empty if nothing is within `radius_m`. Of triangles at equal distance, the one with the lowest index.
  std::optional<ClosestPoint> nearest(const Eigen::Vector3f& p_m, float radius_m) const;

  /// Distance to the first triangle along the ray for which `accept` (index, unit normal) is true.
  using Accept = std::function<bool(std::uint32_t triangle, const Eigen::Vector3f& normal)>;
  std::optional<float> first_hit(const Eigen::Vector3f& origin_m, const Eigen::Vector3f& direction, float limit_m,
                                 const Accept& accept) const;

 private:
  const Model& model_;
  std::unique_ptr<EmbreeScene> scene_;
};

}  // namespace lumigraft::relight
