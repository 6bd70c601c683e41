#include "reconstruct/exposure/direct_irradiance.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lumigraft::reconstruct {

using Eigen::Array3f;
using Eigen::Vector3f;

Array3f unoccluded_irradiance(const Illumination& light, const Vector3f& position_m, const Vector3f& normal) {
  Array3f sum = sh_irradiance(light.environment_sh, normal).array().max(0.0f);
  for (const PointLight& lamp : light.lights) {
    if (lamp.visibility == PointLight::Visibility::dark) continue;
    if (!lamp.distance_known) {
      sum += lamp.irradiance.array() * std::max(0.0f, normal.dot(lamp.direction));
      continue;
    }
    const Vector3f to_lamp = lamp.position_m - position_m;
    const float squared = std::max(to_lamp.squaredNorm(), lamp.radius_m * lamp.radius_m);
    if (!(squared > 0)) continue;
    const Vector3f direction = to_lamp.normalized();
    sum += lamp.intensity.array() * (lamp.emission(-direction) * std::max(0.0f, normal.dot(direction)) / squared);
  }
  return sum;
}

Array3f irradiance_around_probe(const Illumination& light) {
  // π Y₀₀ of the first coefficient; the other harmonics have mean 0.
  Array3f sum = 0.5f * std::sqrt(std::numbers::pi_v<float>) * light.environment_sh[0].array();
  // A lamp's irradiance on all sides of a small sphere is a quarter of that facing it.
  for (const PointLight& lamp : light.lights) {
    if (lamp.visibility != PointLight::Visibility::dark) sum += lamp.irradiance.array() / 4;
  }
  return sum;
}

}  // namespace lumigraft::reconstruct
