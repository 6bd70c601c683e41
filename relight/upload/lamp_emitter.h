#pragma once
// A lamp of a scene as renderers draw it: the one conversion that the GPU's lamps (light_set.h) and those of rays
// (reference/scene_of.h) are made by.
#include <Eigen/Core>

#include "reconstruct/light/light.h"

namespace lumigraft::relight {

/// Where a lamp without a known distance is put: so far that parallax across a room is below a degree.
constexpr float kUnknownLampDistance_m = 100.0f;

/// A sphere that emits evenly, or a disc that emits as a plane does from one side.
struct LampEmitter {
  Eigen::Vector3f centre_m;
  float radius_m;                                    ///< above 0: a lamp's radiance is its intensity over its area
  Eigen::Vector3f intensity;                         ///< W/sr per channel; of a disc towards the probe
  bool flat;                                         ///< a disc
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< unit; of a disc's lit side
  float ahead = 1;                                   ///< intensity of a disc along its normal over `intensity`

  /// W/sr/m² per channel.
  Eigen::Vector3f radiance() const;
};

LampEmitter lamp_emitter(const reconstruct::PointLight& light, const Eigen::Vector3f& probe_m);

}  // namespace lumigraft::relight
