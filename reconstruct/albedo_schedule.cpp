#include "reconstruct/albedo_schedule.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace lumigraft::reconstruct {

using Eigen::Vector3f;

float moved_fraction(const DistanceField& now, const DistanceField& before) {
  if (now.bricks.empty()) return 0;
  const auto mean = [](const FieldBrick& brick) {
    Vector3f sum = Vector3f::Zero();
    float weights = 0;
    for (std::size_t i = 0; brick.color && i < kBrickVoxels; ++i) {
      sum += brick.radiance_weight(i) * brick.color->radiance[i];
      weights += brick.radiance_weight(i);
    }
    return weights > 0 ? (sum / weights).eval() : Vector3f::Zero().eval();
  };
  const auto moved = std::count_if(now.bricks.begin(), now.bricks.end(), [&](const auto& entry) {
    const FieldBrick* was = before.brick(entry.first);
    if (was == entry.second.get()) return false;
    if (!was) return true;
    const Vector3f then = mean(*was), here = mean(*entry.second);
    return (here - then).norm() > kOtherRadiance * std::max(here.norm(), then.norm());
  });
  return static_cast<float>(moved) / static_cast<float>(now.bricks.size());
}

AlbedoDelta compare_albedo(const AlbedoField& now, const AlbedoField& before) {
  double change = 0, sum = 0, sigma = 0, sigma_before = 0;
  std::size_t known = 0, fresh = 0;
  for (const auto& [key, brick] : now.bricks) {
    const auto was = before.bricks.find(key);
    for (std::size_t i = 0; i < brick->sigma.size(); ++i) {
      if (brick->sigma[i] < 0) continue;
      ++known;
      if (was == before.bricks.end() || was->second->sigma[i] < 0) {
        ++fresh;
        continue;
      }
      change += (brick->albedo[i] - was->second->albedo[i]).cwiseAbs().sum();
      sum += was->second->albedo[i].sum();
      sigma += brick->sigma[i];
      sigma_before += was->second->sigma[i];
    }
  }
  return {.change = sum > 0 ? static_cast<float>(change / sum) : 1,
          .newly_known = known > 0 ? static_cast<float>(fresh) / static_cast<float>(known) : 0,
          .surer = sigma_before > 0 ? static_cast<float>(1 - sigma / sigma_before) : 0};
}

AlbedoSchedule::AlbedoSchedule(std::unique_ptr<AlbedoPace> pace) : pace_(std::move(pace)) {}

/// Relative change of the lamps' irradiance since the last solution; infinite if a lamp appeared or disappeared.
double AlbedoSchedule::light_change(const Illumination& light) const {
  constexpr double kOther = std::numeric_limits<double>::infinity();
  if (light.lights.size() != known_->lights.size()) return kOther;
  double difference = 0, sum = 0;
  for (const PointLight& now : light.lights) {
    const PointLight* before = lamp_with_id(known_->lights, now.id);
    if (!before) return kOther;
    // Direction counts as a change of the vector irradiance.
    difference += (now.irradiance.sum() * now.direction - before->irradiance.sum() * before->direction).norm();
    sum += before->irradiance.sum();
  }
  return sum > 0 ? difference / sum : 0;
}

bool AlbedoSchedule::lamp_moved(const Illumination& light) const {
  return std::any_of(light.lights.begin(), light.lights.end(), [&](const PointLight& now) {
    const PointLight* before = lamp_with_id(known_->lights, now.id);
    return before && angle_between(before->direction, now.direction) > kMovedLamp_rad;
  });
}

bool AlbedoSchedule::changed_much(const DistanceField& field, const Illumination& light) const {
  if (!known_) return true;
  return static_cast<double>(field.bricks.size()) > kMuchMoreRoom * static_cast<double>(known_->field->bricks.size()) ||
         light_change(light) > kMuchLight || lamp_moved(light);
}

bool AlbedoSchedule::changed(const DistanceField& field, const Illumination& light) const {
  return !known_ || field.version != known_->field->version || light.version != known_->light_version;
}

bool AlbedoSchedule::moved(const DistanceField& field, const Illumination& light) const {
  return !known_ || light_change(light) > kLittle || moved_fraction(field, *known_->field) > kMoved;
}

AlbedoWork AlbedoSchedule::next(const DistanceField& field, const Illumination& light) {
  pace_->asked();
  learning_ = changed_much(field, light);
  may_solve_everything_ = pace_->waited(AlbedoWork::everything, 1, learning_);
  const bool everything = everything_due_ && (only_everything_ || may_solve_everything_);
  const AlbedoWork work = everything ? AlbedoWork::everything : AlbedoWork::incremental;
  if (!pace_->waited(work, 1, learning_) || !(everything || changed(field, light))) return AlbedoWork::nothing;
  if (!learning_ && !pace_->waited(work, patience_, false) && !(pace_->may_compare() && moved(field, light)))
    return AlbedoWork::nothing;
  return work;
}

void AlbedoSchedule::begin(std::shared_ptr<const DistanceField> field, const Illumination& light) {
  disturbed_ = changed_much(*field, light) || moved(*field, light);
  known_before_ = std::exchange(known_, Known{std::move(field), light.version, light.lights});
  everything_due_ = only_everything_ = false;
}

void AlbedoSchedule::solved(std::shared_ptr<const AlbedoField> albedo, bool everything_due) {
  bool changed_little = false;
  if (albedo && albedo_ && !disturbed_) {
    const AlbedoDelta news = compare_albedo(*albedo, *albedo_);
    changed_little = news.change < kLittle && news.newly_known < kFew && news.surer < kFew;
  }
  patience_ = changed_little ? std::min(2 * patience_, kMaxPatience) : 1;
  if (albedo) albedo_ = std::move(albedo);
  everything_due_ = everything_due;
}

void AlbedoSchedule::wait_for_everything() {
  known_ = std::move(known_before_);
  everything_due_ = only_everything_ = true;
}

}  // namespace lumigraft::reconstruct
