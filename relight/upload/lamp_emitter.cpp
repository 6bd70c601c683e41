#include "relight/upload/lamp_emitter.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "relight/upload/parameters.h"

namespace lumigraft::relight {
Eigen::Vector3f LampEmitter::radiance() const {
  return intensity * ahead / (std::numbers::pi_v<float> * radius_m * radius_m);
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
  }
  return lamp;
}

}  // namespace lumigraft::relight
