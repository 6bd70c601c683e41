#pragma once
// Imperfect shadow maps (Ritschel et al. 2008): what a virtual light sees of the scene, drawn coarsely from points
// instead of triangles on to a paraboloid; holes between the points are filled by pull and push.
#include <memory>
#include <vector>

#include "tests/bench/comparators/virtual_lights.h"

namespace lumigraft::comparators {

struct ScenePoint {
  Eigen::Vector3f position_m = Eigen::Vector3f::Zero(), normal = Eigen::Vector3f::UnitZ();
};

/// Points on surfaces, even by area, in an order in which every run of them is spread over all.
struct ScenePoints {
  std::vector<ScenePoint> points;
  float area_m2 = 0;  ///< of all surfaces together
};
ScenePoints scatter_points(const std::vector<relight::ReferenceMesh>& meshes, int count, std::uint32_t seed);

class ImperfectShadowMap {
 public:
  explicit ImperfectShadowMap(int edge_texels);

  void clear(const VirtualLight& light);
  /// `count` of the points from `first` on, around the end; together they stand for the whole area.
  void draw(const ScenePoints& points, std::size_t first, std::size_t count);
  void fill_holes();

  /// Whether the light reaches a point, as far as the map can tell.
  bool open(const Eigen::Vector3f& p_m) const;

 private:
  int edge_;
  VirtualLight light_;
  Eigen::Matrix3f turn_ = Eigen::Matrix3f::Identity();  // to the light's frame, z along the normal
  std::vector<float> depth_m_;                          // infinity: nothing drawn
};

}  // namespace lumigraft::comparators
