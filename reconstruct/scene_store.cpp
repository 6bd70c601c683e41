#include "reconstruct/scene_store.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "reconstruct/light/environment.h"

namespace lumigraft::reconstruct {
namespace {

bool has_disk_at(const std::vector<PointLight>& lamps, const Eigen::Vector3f& direction, float margin_rad) {
  return std::any_of(lamps.begin(), lamps.end(), [&](const PointLight& lamp) {
    return lamp.direction.dot(direction) > std::cos(lamp.angular_radius_rad + margin_rad);
  });
}

/// Scales clipped and unseen cells of the newest environment by the gain that solving found for them. Cells where
/// solving merged a lamp's disk back into the environment are not changed.
bool raise_as_before(EnvironmentMap& newest, const EnvironmentMap& measured, const EnvironmentMap& solved,
                     const std::vector<PointLight>& put_back) {
  const capture::Image<float>& to = newest.radiance;
  const auto alike = [&](const capture::Image<float>& other) {
    return other.width == to.width && other.height == to.height;
  };
  if (newest.clipped.empty() || measured.clipped.empty() || !alike(measured.radiance) || !alike(solved.radiance))
    return false;
  const float cell_rad = std::numbers::pi_v<float> / static_cast<float>(to.height);
  bool raised = false;
  for (int v = 0; v < to.height; ++v) {
    for (int u = 0; u < to.width; ++u) {
      const auto cell = static_cast<std::size_t>(v) * static_cast<std::size_t>(to.width) + static_cast<std::size_t>(u);
      const bool unseen = !newest.seen.empty() && !newest.seen.data[cell];
      if (!unseen && !(newest.clipped.data[cell] && measured.clipped.data[cell])) continue;
      if (has_disk_at(put_back, environment_direction(u, v, to.width, to.height), cell_rad)) continue;
      for (std::size_t c = 3 * cell; c < 3 * cell + 3; ++c) {
        const float gain = solved.radiance.data[c] / std::max(measured.radiance.data[c], 1e-12f);
        if (!(gain > 1)) continue;
        newest.radiance.data[c] *= gain;
        raised = true;
      }
    }
  }
  return raised;
}

}  // namespace

void SceneStore::publish_field(std::shared_ptr<const DistanceField> field) {
  std::lock_guard lock(mutex_);
  same_field_again_ = field && field == field_;
  field_ = std::move(field);
  combine_fields();
}

void SceneStore::publish_lamp_surface(std::shared_ptr<const SurfaceMask> surface) {
  std::lock_guard lock(mutex_);
  if (surface == lamp_surface_) return;
  lamp_surface_ = std::move(surface);
  combine_fields();
}

void SceneStore::publish_light(std::shared_ptr<const Illumination> light) {
  std::lock_guard lock(mutex_);
  if (light && light->from_shading && light_ && !light_->from_shading) return;
  same_light_again_ = light && light == light_;
  if (light_ != light) {
    light_ = std::move(light);
    combine();
  }
}

void SceneStore::withdraw_light() {
  std::lock_guard lock(mutex_);
  light_ = nullptr;
}

void SceneStore::publish_solution(AlbedoStage::Result solution, std::uint64_t field_version,
                                  std::shared_ptr<const Illumination> measured) {
  std::lock_guard lock(mutex_);
  scene_.albedo = std::move(solution.albedo);
  occluders_ = std::move(solution.occluders);
  combine_fields();
  solved_light_ = std::move(solution.illumination);
  solved_field_version_ = field_version;
  solved_from_ = std::move(measured);
  warnings_["albedo"] = std::move(solution.warnings);
  combine();
}

void SceneStore::publish_albedo(std::shared_ptr<const AlbedoField> albedo) {
  std::lock_guard lock(mutex_);
  scene_.albedo = std::move(albedo);
}

void SceneStore::publish_shadows(std::shared_ptr<const LampShadows> shadows) {
  std::lock_guard lock(mutex_);
  scene_.shadows = std::move(shadows);
}

void SceneStore::publish_enclosure(std::shared_ptr<const Enclosure> enclosure) {
  std::lock_guard lock(mutex_);
  scene_.enclosure = std::move(enclosure);
}

void SceneStore::publish_warnings(const std::string& stage, std::vector<std::string> warnings) {
  std::lock_guard lock(mutex_);
  warnings_[stage] = std::move(warnings);
}

void SceneStore::combine_fields() {
  room_field_ = lamp_mask_.without(field_, lamp_surface_);
  scene_.field = occluder_merge_.merged(room_field_, occluders_);
}

void SceneStore::combine() {
  if (!light_ || !solved_light_) {
    scene_.illumination = light_;
  } else if (light_->version == solved_from_->version) {
    scene_.illumination = solved_light_;
  } else {
    scene_.illumination = carry_lamps(*light_, *solved_from_, *solved_light_);
  }
}

Scene SceneStore::newest() const {
  std::lock_guard lock(mutex_);
  Scene scene = scene_;
  for (const auto& [stage, lines] : warnings_) append_warnings(scene.warnings, lines);
  return scene;
}

bool SceneStore::settled(const Scene& scene) const {
  std::lock_guard lock(mutex_);
  return same_field_again_ && same_light_again_ && scene_.albedo && solved_from_ &&
         scene_.field->version == solved_field_version_ && light_->version == solved_from_->version &&
         scene.field == scene_.field && scene.albedo == scene_.albedo && scene.illumination == scene_.illumination;
}

std::shared_ptr<const Illumination> SceneStore::measured_light() const {
  std::lock_guard lock(mutex_);
  return light_;
}

std::shared_ptr<const DistanceField> SceneStore::observed_field() const {
  std::lock_guard lock(mutex_);
  return field_;
}

std::shared_ptr<const DistanceField> SceneStore::room_field() const {
  std::lock_guard lock(mutex_);
  return room_field_;
}

std::shared_ptr<const Illumination> carry_lamps(const Illumination& newest, const Illumination& measured,
                                                const Illumination& solved) {
  auto carried = std::make_shared<Illumination>(newest);
  carried->lights.clear();
  std::vector<PointLight> put_back;
  for (const PointLight& lamp : measured.lights)
    if (!lamp_with_id(solved.lights, lamp.id)) put_back.push_back(lamp);
  const bool raised = raise_as_before(carried->environment, measured.environment, solved.environment, put_back);
  for (PointLight lamp : newest.lights) {
    const PointLight* before = lamp_with_id(measured.lights, lamp.id);
    const PointLight* known = lamp_with_id(solved.lights, lamp.id);
    const bool unseen = lamp.visibility != PointLight::Visibility::visible;
    const bool was_unseen = before && before->visibility != PointLight::Visibility::visible;
    if (was_unseen && !known && unseen) continue;  // solving found that it is off
    if (before && !known && !was_unseen) {
      add_disk(carried->environment, lamp.direction, lamp.angular_radius_rad, lamp.irradiance);
      continue;
    }
    if (known && ((unseen && was_unseen) || (lamp.clipped && before->clipped))) {
      lamp.irradiance =
          lamp.irradiance.cwiseProduct(known->irradiance.cwiseQuotient(before->irradiance.cwiseMax(1e-12f)));
      lamp.power_log_sigma = known->power_log_sigma;
    }
    if (known && known->distance_known) {
      if (!lamp.distance_known) {
        const float distance_m = (known->position_m - solved.probe_position_m).norm();
        lamp.distance_known = true;
        lamp.position_m = carried->probe_position_m + distance_m * lamp.direction;
        lamp.distance_log_sigma = known->distance_log_sigma;
        lamp.radius_m = distance_m * std::tan(lamp.angular_radius_rad);
      }
      if (!lamp.flat) {
        lamp.flat = known->flat;
        lamp.normal = known->normal;
      }
      // E = I / d² at the probe, facing the lamp
      lamp.intensity = lamp.irradiance * (lamp.position_m - carried->probe_position_m).squaredNorm();
    }
    carried->lights.push_back(lamp);
  }
  if (raised || carried->lights.size() != newest.lights.size()) {
    carried->environment_sh = project_sh(carried->environment);
  }
  return carried;
}

void append_warnings(std::vector<std::string>& to, const std::vector<std::string>& from) {
  for (const std::string& line : from) {
    if (std::find(to.begin(), to.end(), line) == to.end()) to.push_back(line);
  }
}

}  // namespace lumigraft::reconstruct
