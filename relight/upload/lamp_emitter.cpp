#include "relight/upload/lamp_emitter.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "relight/upload/parameters.h"

namespace lumigraft::relight {
namespace {

/// On the lamp's plane, what the probe sees along a tangent.
Eigen::Vector3f on_plane(const reconstruct::PointLight& light, const Eigen::Vector3f& probe_m,
                         const Eigen::Vector3f& tangent) {
  const float cosine = std::min(light.normal.dot(light.direction), -reconstruct::kMinSlantCosine);
  return (light.position_m - probe_m).norm() * (tangent - light.normal.dot(tangent) / cosine * light.direction);
}

}  // namespace

Eigen::Vector3f LampEmitter::radiance() const {
  const float half_square_m2 = half_u_m.isZero() ? radius_m * radius_m : half_u_m.cross(half_v_m).norm();
  return intensity * ahead / (std::numbers::pi_v<float> * half_square_m2);
}

LampEmitter lamp_emitter(const reconstruct::PointLight& light, const Eigen::Vector3f& probe_m) {
  if (!light.distance_known) {
    const float d = kUpload.unknown_distance_m;
    return {.centre_m = probe_m + d * light.direction,
            .radius_m = d * std::tan(std::clamp(light.angular_radius_rad, kUpload.min_rad, kUpload.max_rad)),
            .intensity = light.irradiance * d * d,
            .flat = false};
  }
  LampEmitter lamp{.centre_m = light.position_m,
                   .radius_m = std::max(light.radius_m, kUpload.min_radius_m),
                   .intensity = light.intensity,
                   .flat = light.flat};
  if (light.flat) {
    lamp.normal = light.normal;
    lamp.ahead = light.emission(light.normal);
    if (light.outline_u.isZero()) return lamp;
    lamp.half_u_m = on_plane(light, probe_m, light.outline_u);
    lamp.half_v_m = on_plane(light, probe_m, light.outline_v);
  }
  return lamp;
}

}  // namespace lumigraft::relight
