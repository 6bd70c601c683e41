#pragma once
// Shadows of lamps that the colour camera sees on surface known before: of what moved since, whether or not a camera
// sees it. A point between a lamp and a surface is lit where the surface behind it is. So a shadow is a map over the
// directions from its lamp, as a shadow map is (Williams 1978), of the visible fraction.
#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "capture/image.h"
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

/// Projection of space along the light of one lamp: perspective, or parallel if the lamp is infinitely far.
struct LampProjection {
  Eigen::Vector3f origin_m = Eigen::Vector3f::Zero();  ///< the lamp, tag frame; if far, any point
  Eigen::Matrix3f axes = Eigen::Matrix3f::Identity();  ///< rows: two across the light, then along it; unit, tag frame
  bool far = false;

  /// Two coordinates across the light, metres at 1 m from the lamp (if far: metres), and the distance along it. Empty
  /// behind the lamp and outside the projection.
  std::optional<Eigen::Vector3f> operator()(const Eigen::Vector3f& p_m) const;
};

struct LampShadow {
  int lamp = 0;  ///< PointLight::id
  LampProjection projection;
  Eigen::Vector2f min = Eigen::Vector2f::Zero();  ///< projected centre of the first cell,
  float cell = 1;                                 ///< and edge of a cell
  /// Light that arrives over that without what moved, 0 to 1; bilinear between the centres of cells, 1 beyond the
  /// border.
  capture::Image<float> open;

  float open_at(const Eigen::Vector3f& p_m) const;
};

struct LampShadows {
  std::vector<LampShadow> lamps;  ///< lamps without one are open everywhere
  /// Null: none.
  const LampShadow* of(int lamp) const;
};

}  // namespace lumigraft::reconstruct
