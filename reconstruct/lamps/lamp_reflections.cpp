#include "reconstruct/lamps/lamp_reflections.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "reconstruct/lamps/parameters.h"
#include "reconstruct/light/environment.h"

namespace lumigraft::reconstruct {
namespace {

constexpr const LampParameters::Reflections& kReflections = kLampParameters.reflections;

/// Known surface in five directions over a lamp's disk, its centre first.
std::array<std::optional<Eigen::Vector3f>, 5> surface_behind(const PointLight& light, const Eigen::Vector3f& probe,
                                                             const FieldRays& rays) {
  const Eigen::Vector3f x = light.direction.unitOrthogonal(), y = light.direction.cross(x);
  const float reach = kReflections.disk_reach * std::tan(light.angular_radius_rad);
  std::array<std::optional<Eigen::Vector3f>, 5> hits;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const float u = i == 1 ? reach : i == 2 ? -reach : 0, v = i == 3 ? reach : i == 4 ? -reach : 0;
    hits[i] = rays.first_crossing(probe, (light.direction + u * x + v * y).normalized(), kReflections.max_ray_m);
  }
  return hits;
}

bool is_reflection(const PointLight& light, const Eigen::Vector3f& probe, const DistanceField& field,
                   const FieldRays& rays) {
  const auto hits = surface_behind(light, probe, rays);
  const auto faces_up = [&](const auto& hit) {
    const auto normal = hit ? field.normal(*hit) : std::nullopt;
    return normal && normal->z() > kReflections.min_up_cosine;
  };
  if (faces_up(hits[0]) && std::count_if(hits.begin(), hits.end(), faces_up) >= kReflections.min_up_hits) return true;
  const float solid_angle = 2 * std::numbers::pi_v<float> * (1 - std::cos(std::max(light.angular_radius_rad, 1e-3f)));
  const float level = light.irradiance.mean() / solid_angle;
  for (const auto& hit : hits) {
    const auto radiance = hit ? field.radiance(*hit) : std::nullopt;
    if (!radiance || radiance->mean() * kReflections.min_contrast > level) return false;
  }
  return true;
}

/// Whether the plane z = 0, on which the tag lies, is known surface between the probe and the intersection with the
/// light's ray.
bool plane_on_the_way(const PointLight& light, const Eigen::Vector3f& probe, const DistanceField& field) {
  const Eigen::Vector3f foot(probe.x(), probe.y(), 0);
  const Eigen::Vector3f way = probe - probe.z() / light.direction.z() * light.direction - foot;
  int known = 0;
  for (int i = 1; i <= kReflections.plane_samples; ++i) {
    const auto normal = field.normal(foot + static_cast<float>(i) / kReflections.plane_samples * way);
    known += normal && normal->z() > kReflections.min_up_cosine;
  }
  return known >= kReflections.min_up_hits;
}

/// Whether `image` may be the image of `lamp` in that plane. Probe, lamp and image lie in one vertical plane, and the
/// image is at least as far below the horizon as the lamp is above: as far if the lamp is infinitely distant.
bool is_image(const PointLight& image, const PointLight& lamp) {
  const Eigen::Vector2f to_image = image.direction.head<2>(), to_lamp = lamp.direction.head<2>();
  if (lamp.direction.z() <= 0 || to_image.dot(to_lamp) <= 0) return false;
  const float reach = image.angular_radius_rad + kReflections.image_slack_rad;
  const float aside = (to_lamp.x() * to_image.y() - to_lamp.y() * to_image.x()) / to_lamp.norm();
  const bool weaker = lamp.clipped || image.irradiance.mean() < lamp.irradiance.mean();
  return weaker && std::abs(aside) < reach && -image.direction.z() > lamp.direction.z() - reach;
}

/// Whether the light is the image of another in the plane that the tag lies on, which reaches farther than the field.
bool is_image_in_plane(const PointLight& light, const Illumination& illumination, const DistanceField& field) {
  const Eigen::Vector3f& probe = illumination.probe_position_m;
  return light.direction.z() < 0 && probe.z() > 0 && plane_on_the_way(light, probe, field) &&
         std::any_of(illumination.lights.begin(), illumination.lights.end(),
                     [&](const PointLight& lamp) { return is_image(light, lamp); });
}

}  // namespace

namespace {

/// `is_known`: whether a light is surely a lamp.
template <typename Known>
Illumination without(const Illumination& illumination, const DistanceField& field, const FieldRays& rays,
                     Known is_known) {
  Illumination result = illumination;
  result.lights.clear();
  for (const PointLight& light : illumination.lights) {
    if (light.lamp_tag < 0 && !is_known(light) &&
        (is_reflection(light, illumination.probe_position_m, field, rays) ||
         is_image_in_plane(light, illumination, field))) {
      add_disk(result.environment, light.direction, light.angular_radius_rad, light.irradiance);
    } else {
      result.lights.push_back(light);
    }
  }
  if (result.lights.size() != illumination.lights.size()) result.environment_sh = project_sh(result.environment);
  return result;
}

}  // namespace

Illumination without_reflections(const Illumination& illumination, const DistanceField& field, const FieldRays& rays) {
  return without(illumination, field, rays, [](const PointLight&) { return false; });
}

Illumination ReflectionFilter::without_reflections(const Illumination& illumination, const DistanceField& field,
                                                   const FieldRays& rays) {
  const auto is_known = [&](const PointLight& light) {
    const auto lamp = lamps_.find(light.id);
    return lamp != lamps_.end() &&
           lamp->second.direction.dot(light.direction) > kLampParameters.known_lamps.same_direction &&
           static_cast<double>(field.bricks.size()) <=
               kLampParameters.known_lamps.growth * static_cast<double>(lamp->second.bricks);
  };
  const Illumination result = without(illumination, field, rays, is_known);
  std::map<int, Lamp> lamps;
  for (const PointLight& light : result.lights)
    lamps[light.id] = is_known(light) ? lamps_[light.id] : Lamp{light.direction, field.bricks.size()};
  // One that is off for a while is known when it shines again.
  lamps.merge(lamps_);
  lamps_ = std::move(lamps);
  return result;
}

}  // namespace lumigraft::reconstruct
