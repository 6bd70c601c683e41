#include "reconstruct/light/lamp_tag_matching.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "capture/message_text.h"
#include "reconstruct/light/lamp_merge.h"
#include "reconstruct/light/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

constexpr const LightParameters::TagMatching& kTagMatching = kLightParameters.tag_matching;

/// Irradiance at the probe times squared distance, over intensity along the normal.
float slant(const PointLight& lamp) {
  return lamp.flat ? std::max(-lamp.normal.dot(lamp.direction), kMinSlantCosine) : 1;
}

/// From the probe.
struct PolarPosition {
  Vector3f direction;  ///< unit
  float distance_m;
};
PolarPosition from_probe(const LampTagPose& tag, const Vector3f& probe_m) {
  const Vector3f to = tag.position_m - probe_m;
  return {to.stableNormalized(), std::max(to.norm(), kTagMatching.min_distance_m)};
}

const LampTagPose* tag_of(const std::vector<LampTagPose>& tags, int lamp) {
  const auto found = std::find_if(tags.begin(), tags.end(), [&](const LampTagPose& tag) { return tag.lamp == lamp; });
  return found == tags.end() ? nullptr : &*found;
}

bool has_tag(const std::vector<PointLight>& lights, int tag) {
  return std::any_of(lights.begin(), lights.end(), [&](const PointLight& light) { return light.lamp_tag == tag; });
}

/// Largest angle between a tag's direction and its lamp in the image.
float gate_rad(const LampTagPose& tag, float distance_m, const PointLight& light) {
  return kTagMatching.slack_rad + kTagMatching.gate_sigmas * std::atan(tag.sigma_m / distance_m) +
         kTagMatching.gate_radii * light.angular_radius_rad;
}

/// ∫ L dω at the probe, mean of channels.
float all_light(const Illumination& seen) {
  float sum = seen.environment_sh[0].mean() * std::sqrt(4 * std::numbers::pi_v<float>);
  for (const PointLight& light : seen.lights) sum += light.irradiance.mean();
  return std::max(sum, 1e-6f);
}

std::string dark_warning(const std::string& name, const std::vector<PointLight>& lights, const Vector3f& direction) {
  float nearest_deg = kTagMatching.near_deg;
  for (const PointLight& light : lights)
    if (light.lamp_tag < 0) nearest_deg = std::min(nearest_deg, angle_between(light.direction, direction) / kDegree);
  std::string text = "lamp " + name + ": no light is visible at its tag's position: it is off or hidden";
  if (nearest_deg >= kTagMatching.near_deg) return text;
  return text + capture::formatted("; or it is the light %.0f degrees away, and position_m or tag_size_m is wrong",
                                   nearest_deg);
}

}  // namespace

LampTagMatcher::LampTagMatcher(const capture::Session& session)
    : lamps_(session.lamps), camera_(session.fisheye), powers_(session.lamps.size()) {}

void LampTagMatcher::identify(const std::vector<LampTagPose>& tags, std::vector<PointLight>& lights,
                              const Vector3f& probe_m) const {
  struct Pair {
    float angle;
    std::size_t lamp;
    int tag;
  };
  const std::vector<PointLight> joined = merge_pieces(lights);
  std::vector<Pair> pairs;
  for (const LampTagPose& tag : tags) {
    if (has_tag(lights, tag.lamp)) continue;
    const auto [tag_direction, distance_m] = from_probe(tag, probe_m);
    for (std::size_t i = 0; i < joined.size(); ++i) {
      if (joined[i].lamp_tag >= 0 || joined[i].hidden > 0) continue;
      const float angle = angle_between(joined[i].direction, tag_direction);
      if (angle < gate_rad(tag, distance_m, joined[i])) pairs.push_back({angle, i, tag.lamp});
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) { return a.angle < b.angle; });
  std::vector<bool> taken(joined.size(), false);
  for (const Pair& pair : pairs) {
    if (taken[pair.lamp] || has_tag(lights, pair.tag)) continue;
    taken[pair.lamp] = true;
    const PointLight& lamp = joined[pair.lamp];
    for (PointLight& light : lights)
      if (lamp.region < 0 ? light.id == lamp.id : light.region == lamp.region) light.lamp_tag = pair.tag;
  }
}

bool LampTagMatcher::in_view(const Vector3f& position_m) const {
  if (!camera_) return false;
  const Eigen::Vector3d p = camera_->T_tag_fisheye.inverse() * position_m.cast<double>();
  const double from_axis = std::atan2(p.head<2>().norm(), p.z());
  const auto pixel = camera_->model.project(p);
  return pixel && from_axis < 0.5 * camera_->model.fov_rad - kTagMatching.view_margin_rad && pixel->x() > 0 &&
         pixel->y() > 0 && pixel->x() < camera_->model.width - 1 && pixel->y() < camera_->model.height - 1;
}

void LampTagMatcher::place_seen(PointLight& lamp, const LampTagPose& tag, const Vector3f& probe_m) {
  const capture::TaggedLamp& configured = lamps_[static_cast<std::size_t>(tag.lamp)];
  Power& power = powers_[static_cast<std::size_t>(tag.lamp)];
  const auto [tag_direction, distance_m] = from_probe(tag, probe_m);
  // While the fish-eye is covered its image is older than the tag's pose: the direction is then the tag's.
  const bool elsewhere = angle_between(lamp.direction, tag_direction) > gate_rad(tag, distance_m, lamp);
  if (elsewhere) {
    lamp.direction = tag_direction;
  } else if (lamp.region < 0) {
    const float tag_angle_sigma = tag.sigma_m / distance_m;
    const float tag_variance = tag_angle_sigma * tag_angle_sigma;
    const float weight =
        tag_variance / (tag_variance + kTagMatching.fisheye_sigma_rad * kTagMatching.fisheye_sigma_rad);
    lamp.direction = (weight * lamp.direction + (1 - weight) * tag_direction).normalized();
  }
  if (lamp.region < 0) lamp.angular_radius_rad = std::atan(static_cast<float>(configured.radius_m) / distance_m);
  lamp.distance_known = true;
  lamp.distance_log_sigma = tag.sigma_m / distance_m;
  lamp.position_m = probe_m + distance_m * lamp.direction;
  lamp.flat = configured.normal.has_value();
  lamp.normal = tag.normal;
  const float falloff = slant(lamp) / (distance_m * distance_m);
  if (elsewhere && power.seen && lamp.hidden == 0) lamp.irradiance = *power.seen * falloff;
  if (lamp.clipped && configured.intensity &&
      (*configured.intensity * falloff).sum() > kTagMatching.min_configured_ratio * lamp.irradiance.sum()) {
    lamp.irradiance = *configured.intensity * falloff;
    lamp.clipped = false;
    lamp.power_log_sigma = kTagMatching.known_power_log_sigma;
  }
  if (!lamp.clipped && lamp.hidden == 0) power.seen = lamp.irradiance / falloff;
  lamp.intensity = lamp.irradiance * distance_m * distance_m;
  lamp.radius_m = distance_m * std::tan(lamp.angular_radius_rad);
}

PointLight LampTagMatcher::unseen_lamp(const LampTagPose& tag, const Illumination& seen,
                                       std::vector<std::string>& warnings) {
  const capture::TaggedLamp& configured = lamps_[static_cast<std::size_t>(tag.lamp)];
  Power& power = powers_[static_cast<std::size_t>(tag.lamp)];
  PointLight lamp;
  lamp.lamp_tag = tag.lamp;
  const auto [direction, distance_m] = from_probe(tag, seen.probe_position_m);
  lamp.direction = direction;
  lamp.position_m = tag.position_m;
  lamp.radius_m = static_cast<float>(configured.radius_m);
  lamp.angular_radius_rad = std::atan(lamp.radius_m / distance_m);
  lamp.distance_known = true;
  lamp.distance_log_sigma = tag.sigma_m / distance_m;
  lamp.flat = configured.normal.has_value();
  lamp.normal = tag.normal;
  const bool turned_away = lamp.flat && -lamp.normal.dot(lamp.direction) < kTagMatching.min_facing_cosine;
  lamp.visibility =
      in_view(tag.position_m) && !turned_away ? PointLight::Visibility::dark : PointLight::Visibility::outside_view;
  const float falloff = slant(lamp) / (distance_m * distance_m);
  const std::optional<Vector3f> known = power.seen ? power.seen : configured.intensity;
  if (lamp.visibility == PointLight::Visibility::dark)
    warnings.push_back(dark_warning(configured.name, seen.lights, lamp.direction));
  if (lamp.visibility == PointLight::Visibility::outside_view && known) {
    lamp.irradiance = *known * falloff;
    lamp.power_log_sigma = kTagMatching.known_power_log_sigma;
  } else {
    if (!power.guess) power.guess = Vector3f::Constant(kTagMatching.unknown_power_fraction * all_light(seen) / falloff);
    lamp.irradiance = *power.guess * falloff;
    lamp.power_log_sigma = kUnknownPowerLogSigma;
  }
  lamp.intensity = lamp.irradiance * distance_m * distance_m;
  return lamp;
}

LampTagMatcher::Result LampTagMatcher::place(const Illumination& seen, const std::vector<LampTagPose>& tags,
                                             const std::function<int(int)>& id_of) {
  Result result;
  std::vector<PointLight> lights = seen.lights;
  for (PointLight& light : lights)
    if (!tag_of(tags, light.lamp_tag)) light.lamp_tag = -1;
  // A held lamp may be occluded; if its tag is outside the view it left the image instead.
  std::erase_if(lights, [&](const PointLight& light) {
    return light.hidden > 0 && light.lamp_tag >= 0 && !in_view(tag_of(tags, light.lamp_tag)->position_m);
  });
  const std::vector<PointLight> joined = merge_pieces(lights);
  std::vector<PointLight> placed = joined;
  for (PointLight& lamp : placed)
    if (lamp.lamp_tag >= 0) place_seen(lamp, *tag_of(tags, lamp.lamp_tag), seen.probe_position_m);
  result.lights = place_pieces(lights, joined, placed, seen.probe_position_m);
  for (PointLight& light : result.lights) {
    const auto lamp = std::find_if(placed.begin(), placed.end(), [&](const PointLight& p) {
      return light.lamp_tag >= 0 && p.lamp_tag == light.lamp_tag;
    });
    if (lamp == placed.end()) continue;
    if (light.region < 0)
      light = *lamp;
    else
      light.clipped = lamp->clipped;
  }
  for (const LampTagPose& tag : tags) {
    if (has_tag(lights, tag.lamp)) continue;
    result.lights.push_back(unseen_lamp(tag, seen, result.warnings));
    result.lights.back().id = id_of(tag.lamp);
  }
  return result;
}

bool same_places(const std::vector<PointLight>& a, const std::vector<PointLight>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const PointLight& p, const PointLight& q) {
    return p.id == q.id && p.lamp_tag == q.lamp_tag && p.visibility == q.visibility && p.clipped == q.clipped &&
           p.flat == q.flat && p.distance_known == q.distance_known &&
           (p.position_m - q.position_m).norm() < kTagMatching.same_position_m &&
           (p.irradiance - q.irradiance).norm() <= kTagMatching.same_irradiance * q.irradiance.norm() &&
           (p.normal - q.normal).norm() < kTagMatching.same_normal;
  });
}

}  // namespace lumigraft::reconstruct
