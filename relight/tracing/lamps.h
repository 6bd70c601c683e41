#pragma once
// Rays and lamps: hits, and points to look at with their density over solid angle.
#include <optional>

#include "relight/tracing/trace_scene.h"

namespace lumigraft::relight {

/// Where a ray meets a lamp; from behind or from within a lamp is dark.
std::optional<float> lamp_hit(const ReferenceLamp& lamp, const Eigen::Vector3f& from_m, const Eigen::Vector3f& w);

/// The first of those that hide, along a ray.
struct LampHit {
  std::size_t lamp = 0;
  float t_m = 0;
};
std::optional<LampHit> nearest_lamp(const std::vector<ReferenceLamp>& lamps, const Eigen::Vector3f& from_m,
                                    const Eigen::Vector3f& w);
/// Whether another lamp, of those that hide, stands in the way to one, nearer than `limit_m`.
bool behind_other_lamp(const std::vector<ReferenceLamp>& lamps, std::size_t lamp, const Eigen::Vector3f& from_m,
                       const Eigen::Vector3f& w, float limit_m);
/// Rays that look for what is in the way to a lamp end this much before it.
constexpr float kBeforeLamp_m = 1e-4f;

/// Veach & Guibas 1995, the balance heuristic.
inline float balanced(float own_pdf, float other_pdf) { return own_pdf / (own_pdf + other_pdf); }

/// What the lamp sends back along w from where it is hit.
Rgb lamp_radiance(const ReferenceLamp& lamp, const Eigen::Vector3f& from_m, const Eigen::Vector3f& w);

struct LightSample {
  Eigen::Vector3f w = Eigen::Vector3f::Zero();  ///< unit, towards the light
  float distance_m = 0;
  Rgb radiance = Rgb::Zero();
  float pdf = 0;  ///< 1/sr; 0: there is nothing to see from here
};
LightSample sample_lamp(const ReferenceLamp& lamp, const Eigen::Vector3f& from_m, const Eigen::Vector2f& u);
/// Density of sample_lamp along a ray that hits the lamp.
float lamp_pdf(const ReferenceLamp& lamp, const Eigen::Vector3f& from_m, const Eigen::Vector3f& w);

/// Evenly over a flat lamp, `u` in [0, 1)².
Eigen::Vector3f point_on(const ReferenceLamp& lamp, const Eigen::Vector2f& u);
float area_m2(const ReferenceLamp& lamp);  ///< likewise

/// Of a sphere around it.
float lamp_reach_m(const ReferenceLamp& lamp);

/// Unit vectors that make a right-handed frame with n (Duff et al. 2017).
void basis(const Eigen::Vector3f& n, Eigen::Vector3f& x, Eigen::Vector3f& y);

/// Evenly within `1 - cos` of an axis; and 1 - cos of the cone that a sphere fills from `distance`, without
/// cancellation.
Eigen::Vector3f in_cone(const Eigen::Vector3f& axis, float one_minus_cos, const Eigen::Vector2f& u);
float cone_of_sphere(float radius_m, float distance_m);

}  // namespace lumigraft::relight
