#pragma once
// Geometry and emission of a scene's lamp, for all renderers: both the GPU's lamps (light_set.h) and those of ray
// tracing (tracing/build_trace_scene.h) are converted from it.
#include <Eigen/Core>

#include "reconstruct/light/light.h"

namespace lumigraft::relight {

/// A sphere of uniform radiance, or a one-sided disc that is a Lambert emitter: round, or an ellipse where the outline
/// of the lamp is known.
struct LampEmitter {
  Eigen::Vector3f centre_m;
  float radius_m;                                    ///< above 0; a lamp's radiance is its intensity over its area
  Eigen::Vector3f intensity;                         ///< W/sr per channel; of a disc: towards the probe
  bool flat;                                         ///< whether it is a disc
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< unit; of a disc's emitting side
  float ahead = 1;                                   ///< a disc's intensity along its normal over `intensity`
  /// Conjugate half axes of an ellipse; zero: a sphere or round.
  Eigen::Vector3f half_u_m = Eigen::Vector3f::Zero(), half_v_m = Eigen::Vector3f::Zero();

  /// W/sr/m² per channel.
  Eigen::Vector3f radiance() const;
};

LampEmitter lamp_emitter(const reconstruct::PointLight& light, const Eigen::Vector3f& probe_m);

}  // namespace lumigraft::relight
