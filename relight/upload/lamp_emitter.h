#pragma once
// Geometry and emission of a scene's lamp, for all renderers: both the GPU's lamps (light_set.h) and those of ray
// tracing (tracing/build_trace_scene.h) are converted from it.
#include <Eigen/Core>

#include "reconstruct/light/light.h"

namespace lumigraft::relight {

/// A sphere of uniform radiance, or a one-sided disc that is a Lambert emitter.
struct LampEmitter {
  Eigen::Vector3f centre_m;
  float radius_m;                                    ///< above 0; a lamp's radiance is its intensity over its area
  Eigen::Vector3f intensity;                         ///< W/sr per channel; of a disc: towards the probe
  bool flat;                                         ///< whether it is a disc
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< unit; of a disc's emitting side
  float ahead = 1;                                   ///< a disc's intensity along its normal over `intensity`

  /// W/sr/m² per channel.
  Eigen::Vector3f radiance() const;
};

LampEmitter lamp_emitter(const reconstruct::PointLight& light, const Eigen::Vector3f& probe_m);

}  // namespace lumigraft::relight
