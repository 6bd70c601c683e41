#include "server/albedo_schedule.h"

#include <algorithm>

namespace lumigraft {

bool AlbedoSchedule::changed_much(const DistanceField& field, const Illumination& light) const {
  if (!known_) {
    return true;
  }
  if (static_cast<double>(field.bricks.size()) > kMuchMoreRoom * static_cast<double>(known_->bricks) ||
      light.lights.size() != known_->lights.size()) {
    return true;
  }
  double difference = 0, sum = 0;
  for (const PointLight& now : light.lights) {
    const auto before =
        std::find_if(known_->lights.begin(), known_->lights.end(), [&](const PointLight& l) { return l.id == now.id; });
    if (before == known_->lights.end()) {
      return true;
    }
    // Direction counts as a change of the vector irradiance.
    difference += (now.irradiance.sum() * now.direction - before->irradiance.sum() * before->direction).norm();
    sum += before->irradiance.sum();
  }
  return difference > kMuchLight * sum;
}

bool AlbedoSchedule::changed(const DistanceField& field, const Illumination& light) const {
  return !known_ || field.version != known_->field_version || light.version != known_->light_version;
}

bool AlbedoSchedule::due(const DistanceField& field, const Illumination& light) {
  ++frames_since_;
  return changed_much(field, light) || (frames_since_ >= kFrames && changed(field, light));
}

void AlbedoSchedule::solved(const DistanceField& field, const Illumination& light) {
  known_ = Known{field.version, light.version, field.bricks.size(), light.lights};
  frames_since_ = 0;
}

}  // namespace lumigraft
