#include "reconstruct/light/fluence.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lumigraft::reconstruct {

Eigen::Array3f mean_irradiance(const Illumination& light, const Eigen::Vector3f& position_m) {
  // π Y₀₀ of the first coefficient; the other harmonics have mean 0.
  Eigen::Array3f sum = 0.5f * std::sqrt(std::numbers::pi_v<float>) * light.environment_sh[0].array();
  for (const PointLight& lamp : light.lights) {
    if (lamp.visibility == PointLight::Visibility::dark) continue;
    // A lamp's irradiance on all sides of a small sphere is a quarter of that facing it.
    if (!lamp.distance_known) {
      sum += lamp.irradiance.array() / 4;
      continue;
    }
    const Eigen::Vector3f offset = position_m - lamp.position_m;
    const float squared = std::max({offset.squaredNorm(), lamp.radius_m * lamp.radius_m, 1e-9f});
    sum += lamp.intensity.array() * (lamp.emission(offset.normalized()) / (4 * squared));
  }
  return sum;
}

Eigen::Array3f lamp_irradiance(const PointLight& lamp, const Eigen::Vector3f& position_m,
                               const Eigen::Vector3f& normal) {
  if (lamp.visibility == PointLight::Visibility::dark) return Eigen::Array3f::Zero();
  if (!lamp.distance_known) return lamp.irradiance.array() * std::max(0.0f, normal.dot(lamp.direction));
  const Eigen::Vector3f to_lamp = lamp.position_m - position_m;
  const float squared = std::max(to_lamp.squaredNorm(), lamp.radius_m * lamp.radius_m);
  if (!(squared > 0)) return Eigen::Array3f::Zero();
  const Eigen::Vector3f direction = to_lamp.normalized();
  return lamp.intensity.array() * (lamp.emission(-direction) * std::max(0.0f, normal.dot(direction)) / squared);
}

Eigen::Array3f environment_irradiance(const Illumination& light, const Eigen::Vector3f& normal) {
  return sh_irradiance(light.environment_sh, normal).array().max(0.0f);
}

Eigen::Array3f unoccluded_irradiance(const Illumination& light, const Eigen::Vector3f& position_m,
                                     const Eigen::Vector3f& normal) {
  Eigen::Array3f sum = environment_irradiance(light, normal);
  for (const PointLight& lamp : light.lights) sum += lamp_irradiance(lamp, position_m, normal);
  return sum;
}

}  // namespace lumigraft::reconstruct
