#pragma once
// Imperfect shadow maps (Ritschel et al. 2008): a coarse paraboloid depth map of a virtual light, drawn from points
// instead of triangles; holes between points are filled by pull-push.
#include <memory>
#include <vector>

#include "tests/bench/comparators/virtual_lights.h"

namespace lumigraft::comparators {

struct ScenePoint {
  Eigen::Vector3f position_m = Eigen::Vector3f::Zero(), normal = Eigen::Vector3f::UnitZ();
};

/// Points on surfaces, uniform by area; every contiguous range is spread over all surfaces.
struct ScenePoints {
  std::vector<ScenePoint> points;
  float area_m2 = 0;  ///< of all surfaces
};
ScenePoints scatter_points(const std::vector<relight::ReferenceMesh>& meshes, int count, std::uint32_t seed);

class ImperfectShadowMap {
 public:
  explicit ImperfectShadowMap(int edge_texels);

  void clear(const VirtualLight& light);
  /// Draws `count` points from `first` on, cyclically; together they represent the whole area.
  void draw(const ScenePoints& points, std::size_t first, std::size_t count);
  void fill_holes();

  /// Visibility of a point from the light, at the map's resolution.
  bool open(const Eigen::Vector3f& p_m) const;

 private:
  int edge_;
  VirtualLight light_;
  Eigen::Matrix3f turn_ = Eigen::Matrix3f::Identity();  // to the light's frame, z along the normal
  std::vector<float> depth_m_;                          // infinity: empty
};

}  // namespace lumigraft::comparators
