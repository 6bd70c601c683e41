#pragma once
// Converts the lights of a scene to shader data: the strongest lamps as spheres or discs, everything else as one
// environment map.
#include <Eigen/Core>
#include <vector>

#include "reconstruct/light/light.h"
#include "relight/shaders/common/interop.h"

namespace lumigraft::relight {

struct LightSet {
  std::vector<shader::Lamp> lamps;  ///< at most shader::kMaxLamps, strongest first
  std::vector<int> lamp_ids;        ///< of these, PointLight::id
  /// The residual environment and the lamps that are not rendered as lamps, as an equal-area octahedral map (Clarberg
  /// 2008): the mean of its texels is the mean over the sphere, at every level. RGBA, level 0 first, each level has
  /// half the edge.
  std::vector<capture::Image<float>> environment;
};

/// Unit square [0, 1]² to unit direction; the inverse of octahedral() in volume.glsl.
Eigen::Vector3f octahedral_direction(const Eigen::Vector2f& uv);

LightSet make_light_set(const reconstruct::Illumination& illumination, int max_lights);

}  // namespace lumigraft::relight
