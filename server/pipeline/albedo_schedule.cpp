#include "server/pipeline/albedo_schedule.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "server/pipeline/scene_change.h"

namespace lumigraft::server {

/// Of the lamps' irradiance since the last solution; infinite where a lamp came or went.
double AlbedoSchedule::light_change(const reconstruct::Illumination& light) const {
  constexpr double kOther = std::numeric_limits<double>::infinity();
  if (light.lights.size() != known_->lights.size()) return kOther;
  double difference = 0, sum = 0;
  for (const reconstruct::PointLight& now : light.lights) {
    const auto before = std::find_if(known_->lights.begin(), known_->lights.end(),
                                     [&](const reconstruct::PointLight& l) { return l.id == now.id; });
    if (before == known_->lights.end()) return kOther;
    // Direction counts as a change of the vector irradiance.
    difference += (now.irradiance.sum() * now.direction - before->irradiance.sum() * before->direction).norm();
    sum += before->irradiance.sum();
  }
  return sum > 0 ? difference / sum : 0;
}

bool AlbedoSchedule::changed_much(const reconstruct::DistanceField& field,
                                  const reconstruct::Illumination& light) const {
  if (!known_) return true;
  return static_cast<double>(field.bricks.size()) > kMuchMoreRoom * static_cast<double>(known_->field->bricks.size()) ||
         light_change(light) > kMuchLight;
}

bool AlbedoSchedule::changed(const reconstruct::DistanceField& field, const reconstruct::Illumination& light) const {
  return !known_ || field.version != known_->field->version || light.version != known_->light_version;
}

bool AlbedoSchedule::moved(const reconstruct::DistanceField& field, const reconstruct::Illumination& light) const {
  return !known_ || light_change(light) > kLittle || moved_share(field, *known_->field) > kMoved;
}

bool AlbedoSchedule::due(const reconstruct::DistanceField& field, const reconstruct::Illumination& light) {
  ++frames_since_;
  if (changed_much(field, light)) return true;
  if (frames_since_ < kFrames || !changed(field, light)) return false;
  return frames_since_ >= kFrames * patience_ || (frames_since_ % kFrames == 0 && moved(field, light));
}

void AlbedoSchedule::begin(std::shared_ptr<const reconstruct::DistanceField> field,
                           const reconstruct::Illumination& light) {
  disturbed_ = changed_much(*field, light) || moved(*field, light);
  known_ = Known{std::move(field), light.version, light.lights};
  frames_since_ = 0;
}

void AlbedoSchedule::solved(std::shared_ptr<const reconstruct::AlbedoField> albedo) {
  bool told_little = false;
  if (albedo && albedo_ && !disturbed_) {
    const AlbedoDelta news = compare_albedo(*albedo, *albedo_);
    told_little = news.change < kLittle && news.newly_known < kFew && news.surer < kFew;
  }
  patience_ = told_little ? std::min(2 * patience_, kMostPatience) : 1;
  if (albedo) albedo_ = std::move(albedo);
}

}  // namespace lumigraft::server
