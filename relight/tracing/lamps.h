#pragma once
// Lamps in ray tracing: intersection, sampling of points, and densities over solid angle.
#include <algorithm>
#include <optional>

#include "reconstruct/shading/parameters.h"
#include "relight/tracing/parameters.h"
#include "relight/tracing/trace_scene.h"

namespace lumigraft::relight {

/// Distance at which a ray hits a lamp; none from behind or inside a lamp, which is dark there.
std::optional<float> lamp_hit(const ReferenceLamp& lamp, const Eigen::Vector3f& from_m, const Eigen::Vector3f& w);

/// The nearest occluding lamp along a ray.
struct LampHit {
  std::size_t lamp = 0;
  float t_m = 0;
};
std::optional<LampHit> nearest_lamp(const std::vector<ReferenceLamp>& lamps, const Eigen::Vector3f& from_m,
                                    const Eigen::Vector3f& w);
/// Whether another occluding lamp is in front of the given one, nearer than `limit_m`.
bool behind_other_lamp(const std::vector<ReferenceLamp>& lamps, std::size_t lamp, const Eigen::Vector3f& from_m,
                       const Eigen::Vector3f& w, float limit_m);
/// End of a shadow ray towards a lamp of a reconstructed room. `distance_m`: along the ray to the lamp's surface. The
/// distance field contains the lamp's body with the errors of depth, and the lamp's position has its own; rays to a
/// bulb end as far before it as in reconstruction, so that the body does not occlude the lamp.
inline float before_lamp_body_m(const ReferenceLamp& lamp, float distance_m) {
  const bool bulb = lamp.shape == ReferenceLamp::Shape::sphere;
  const float body_m = bulb ? (reconstruct::kShadingParameters.lamp_radii_clear - 1) * lamp.radius_m : 0;
  return std::max(distance_m - std::max(body_m, kTracing.before_lamp_m), 0.0f);
}

/// Veach & Guibas 1995, the balance heuristic.
inline float balanced(float own_pdf, float other_pdf) { return own_pdf / (own_pdf + other_pdf); }

/// The radiance that the lamp emits along -w, towards the ray's origin.
Rgb lamp_radiance(const ReferenceLamp& lamp, const Eigen::Vector3f& from_m, const Eigen::Vector3f& w);

struct LightSample {
  Eigen::Vector3f w = Eigen::Vector3f::Zero();  ///< unit, towards the lamp
  float distance_m = 0;
  Rgb radiance = Rgb::Zero();
  float pdf = 0;  ///< 1/sr; 0: not visible from here
};
LightSample sample_lamp(const ReferenceLamp& lamp, const Eigen::Vector3f& from_m, const Eigen::Vector2f& u);
/// Density of sample_lamp for a ray that hits the lamp.
float lamp_pdf(const ReferenceLamp& lamp, const Eigen::Vector3f& from_m, const Eigen::Vector3f& w);

/// Uniform over a flat lamp, `u` in [0, 1)².
Eigen::Vector3f point_on(const ReferenceLamp& lamp, const Eigen::Vector2f& u);
float area_m2(const ReferenceLamp& lamp);  ///< of a flat lamp

/// Radius of the bounding sphere around its centre.
float lamp_reach_m(const ReferenceLamp& lamp);

/// Unit vectors x, y that form a right-handed frame with n (Duff et al. 2017).
void basis(const Eigen::Vector3f& n, Eigen::Vector3f& x, Eigen::Vector3f& y);

/// in_cone: uniform over the cone with the given `1 - cos` around an axis. Below: 1 - cos of the cone that a sphere
/// subtends from `distance`, without cancellation.
Eigen::Vector3f in_cone(const Eigen::Vector3f& axis, float one_minus_cos, const Eigen::Vector2f& u);
float cone_of_sphere(float radius_m, float distance_m);

}  // namespace lumigraft::relight
