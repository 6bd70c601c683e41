#include "reconstruct/lamps/lamp_reflections.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "reconstruct/lamps/parameters.h"
#include "reconstruct/light/environment.h"

namespace lumigraft::reconstruct {
namespace {

constexpr const LampParameters::Reflections& kReflections = kLampParameters.reflections;

bool is_reflection(const PointLight& light, const Eigen::Vector3f& probe, const DistanceField& field,
                   const FieldRays& rays) {
  const float solid_angle = 2 * std::numbers::pi_v<float> * (1 - std::cos(std::max(light.angular_radius_rad, 1e-3f)));
  const float level = light.irradiance.mean() / solid_angle;
  const Eigen::Vector3f x = light.direction.unitOrthogonal(), y = light.direction.cross(x);
  const float reach = kReflections.disk_reach * std::tan(light.angular_radius_rad);
  for (int i = 0; i < 5; ++i) {
    const float u = i == 1 ? reach : i == 2 ? -reach : 0, v = i == 3 ? reach : i == 4 ? -reach : 0;
    const auto hit = rays.first_crossing(probe, (light.direction + u * x + v * y).normalized(), kReflections.max_ray_m);
    const auto radiance = hit ? field.radiance(*hit) : std::nullopt;
    if (!radiance || radiance->mean() * kReflections.min_contrast > level) return false;
  }
  return true;
}

}  // namespace

Illumination without_reflections(const Illumination& illumination, const DistanceField& field, const FieldRays& rays) {
  Illumination result = illumination;
  result.lights.clear();
  for (const PointLight& light : illumination.lights) {
    if (light.lamp_tag < 0 && is_reflection(light, illumination.probe_position_m, field, rays)) {
      add_disk(result.environment, light.direction, light.angular_radius_rad, light.irradiance);
    } else {
      result.lights.push_back(light);
    }
  }
  if (result.lights.size() != illumination.lights.size()) result.environment_sh = project_sh(result.environment);
  return result;
}

}  // namespace lumigraft::reconstruct
