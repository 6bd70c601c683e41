#include "server/scene_board.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace lumigraft {

void SceneBoard::publish_field(std::shared_ptr<const DistanceField> field) {
  std::lock_guard lock(mutex_);
  same_field_again_ = field && field == scene_.field;
  scene_.field = std::move(field);
}

void SceneBoard::publish_light(std::shared_ptr<const Illumination> light) {
  std::lock_guard lock(mutex_);
  same_light_again_ = light && light == light_;
  if (light_ != light) {
    light_ = std::move(light);
    combine();
  }
}

void SceneBoard::publish_solution(AlbedoStage::Result solution, std::uint64_t field_version,
                                  std::uint64_t light_version) {
  std::lock_guard lock(mutex_);
  scene_.albedo = std::move(solution.albedo);
  solved_light_ = std::move(solution.illumination);
  solved_field_version_ = field_version;
  solved_light_version_ = light_version;
  warnings_["albedo"] = std::move(solution.warnings);
  combine();
}

void SceneBoard::publish_albedo(std::shared_ptr<const AlbedoField> albedo) {
  std::lock_guard lock(mutex_);
  scene_.albedo = std::move(albedo);
}

void SceneBoard::publish_enclosure(std::shared_ptr<const Enclosure> enclosure) {
  std::lock_guard lock(mutex_);
  scene_.enclosure = std::move(enclosure);
}

void SceneBoard::publish_warnings(const std::string& stage, std::vector<std::string> warnings) {
  std::lock_guard lock(mutex_);
  warnings_[stage] = std::move(warnings);
}

void SceneBoard::combine() {
  if (!light_ || !solved_light_) {
    scene_.illumination = light_;
  } else if (light_->version == solved_light_version_) {
    scene_.illumination = solved_light_;
  } else {
    scene_.illumination = carry_lamp_distances(*light_, *solved_light_);
  }
}

Scene SceneBoard::newest() const {
  std::lock_guard lock(mutex_);
  Scene scene = scene_;
  for (const auto& [stage, lines] : warnings_) {
    append_warnings(scene.warnings, lines);
  }
  return scene;
}

bool SceneBoard::settled(const Scene& scene) const {
  std::lock_guard lock(mutex_);
  return same_field_again_ && same_light_again_ && scene_.albedo && scene_.field->version == solved_field_version_ &&
         light_->version == solved_light_version_ && scene.field == scene_.field && scene.albedo == scene_.albedo &&
         scene.illumination == scene_.illumination;
}

std::shared_ptr<const Illumination> SceneBoard::measured_light() const {
  std::lock_guard lock(mutex_);
  return light_;
}

std::shared_ptr<const Illumination> carry_lamp_distances(const Illumination& newest, const Illumination& solved) {
  auto carried = std::make_shared<Illumination>(newest);
  for (PointLight& lamp : carried->lights) {
    const auto known = std::find_if(solved.lights.begin(), solved.lights.end(),
                                    [&](const PointLight& l) { return l.id == lamp.id && l.distance_known; });
    if (lamp.distance_known || known == solved.lights.end()) {
      continue;
    }
    const float distance_m = (known->position_m - solved.probe_position_m).norm();
    lamp.distance_known = true;
    lamp.position_m = carried->probe_position_m + distance_m * lamp.direction;
    lamp.intensity = lamp.irradiance * (distance_m * distance_m);  // E = I / d² at the probe, facing the lamp
    lamp.radius_m = distance_m * std::tan(lamp.angular_radius_rad);
  }
  return carried;
}

void append_warnings(std::vector<std::string>& to, const std::vector<std::string>& from) {
  for (const std::string& line : from) {
    if (std::find(to.begin(), to.end(), line) == to.end()) {
      to.push_back(line);
    }
  }
}

}  // namespace lumigraft
