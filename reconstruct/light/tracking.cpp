#include "reconstruct/light/tracking.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "reconstruct/light/environment.h"
#include "reconstruct/light/fluence.h"
#include "reconstruct/light/parameters.h"
#include "reconstruct/math/median.h"

namespace lumigraft::reconstruct {
namespace {

constexpr const LightParameters::Tracking& kTracking = kLightParameters.tracking;
constexpr const LightParameters::Tracking::Covered& kCovered = kTracking.covered;
constexpr float kTagFirst = 10;  ///< above any angle: pairs with the same tag are matched first

struct Match {
  float angle;
  std::size_t now, last;
};

bool same_hue(const Eigen::Array3f& a, const Eigen::Array3f& b) {
  const Eigen::Array3f ratio = a / b;
  return ((ratio / ratio.mean() - 1).abs() < kTracking.max_carried_hue).all();
}

/// Whether two lamps may be one that was carried on: alike in power and colour.
bool alike(const PointLight& now, const PointLight& last) {
  const float brighter = (now.irradiance.array() / last.irradiance.array()).mean();
  return now.clipped == last.clipped && now.region < 0 && last.region < 0 && last.hidden == 0 && !last.covered &&
         std::max(brighter, 1 / brighter) < kTracking.max_carried_ratio &&
         same_hue(now.irradiance.array(), last.irradiance.array());
}

/// For each lamp of `now` the index of its lamp in `last`, or -1: first those with the same tag, then nearest pairs,
/// then the nearest alike.
std::vector<int> match(const std::vector<PointLight>& now, const std::vector<PointLight>& last) {
  constexpr float kCarriedLast = 10;  // above any angle
  std::vector<Match> pairs;
  for (std::size_t i = 0; i < now.size(); ++i) {
    for (std::size_t j = 0; j < last.size(); ++j) {
      const bool tagged = now[i].lamp_tag >= 0 && last[j].lamp_tag >= 0,
                 same = tagged && now[i].lamp_tag == last[j].lamp_tag;
      const float angle = angle_between(now[i].direction, last[j].direction);
      if (same || (!tagged && angle < kTracking.max_lamp_angle_rad))
        pairs.push_back({same ? angle - kTagFirst : angle, i, j});
      else if (!tagged && angle < kTracking.max_carried_angle_rad && alike(now[i], last[j]))
        pairs.push_back({angle + kCarriedLast, i, j});
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(), [](const Match& a, const Match& b) { return a.angle < b.angle; });
  std::vector<int> result(now.size(), -1);
  std::vector<bool> taken(last.size(), false);
  for (const Match& pair : pairs) {
    if (result[pair.now] >= 0 || taken[pair.last]) continue;
    result[pair.now] = static_cast<int>(pair.last);
    taken[pair.last] = true;
  }
  return result;
}

bool still(const PointLight& now, const PointLight& last) {
  return now.lamp_tag == last.lamp_tag &&
         angle_between(now.direction, last.direction) < kTracking.max_still_angle_rad && now.clipped == last.clipped &&
         (now.irradiance - last.irradiance).norm() < kTracking.max_still_change * last.irradiance.norm();
}

/// Whether the environment is still: by its harmonics, as single cells are noisy.
bool still(const Sh9& now, const Sh9& last) {
  float change = 0, sum = 0;
  for (std::size_t i = 0; i < now.size(); ++i) {
    change += (now[i] - last[i]).squaredNorm();
    sum += last[i].squaredNorm();
  }
  return change <= kTracking.max_still_change * kTracking.max_still_change * sum;
}

/// ∫ L dω, mean of channels.
double energy(const Illumination& light) {
  double sum = 0;
  for (const PointLight& lamp : light.lights) sum += lamp.irradiance.mean();
  const capture::Image<float>& map = light.environment.radiance;
  for (int v = 0; v < map.height; ++v) {
    double row = 0;
    for (int u = 0; u < map.width; ++u) row += (map.at(u, v, 0) + map.at(u, v, 1) + map.at(u, v, 2)) / 3;
    sum += row * environment_solid_angle_sr(v, map.width, map.height);
  }
  return sum;
}

float solid_angle_sr(const PointLight& lamp) {
  return 2 * std::numbers::pi_v<float> * (1 - std::cos(lamp.angular_radius_rad));
}

/// Whether these parts are what is left to be seen of a lamp; else it dimmed, or moved.
bool is_cut(const PointLight& whole, const std::vector<const PointLight*>& parts) {
  Eigen::Vector3f irradiance = Eigen::Vector3f::Zero(), centroid = Eigen::Vector3f::Zero();
  float left_sr = 0;
  for (const PointLight* part : parts) {
    irradiance += part->irradiance;
    centroid += solid_angle_sr(*part) * part->direction;
    left_sr += solid_angle_sr(*part);
  }
  const float covered = 1 - left_sr / solid_angle_sr(whole);
  if (!(covered > kCovered.min_fraction && covered < 1)) return false;
  const float radiance = irradiance.mean() / whole.irradiance.mean() / (1 - covered);
  if (radiance < kCovered.min_radiance || radiance > kCovered.max_brighter ||
      !same_hue(irradiance.array(), whole.irradiance.array()))
    return false;
  const float shift_rad = angle_between(centroid.normalized(), whole.direction);
  return parts.size() > 1 || shift_rad > kCovered.min_shift * covered * whole.angular_radius_rad;
}

/// The median over the environment of how its radiance changed, as a ratio.
float median_change(const EnvironmentMap& now, const EnvironmentMap& before) {
  const std::vector<float>&a = now.radiance.data, &b = before.radiance.data;
  std::vector<float> ratios;
  if (a.size() != b.size()) return 0;
  for (std::size_t i = 0; i + 2 < a.size(); i += 3) {
    const bool seen = before.seen.empty() || before.seen.data[i / 3];
    const float was = b[i] + b[i + 1] + b[i + 2];
    if (seen && was > 0) ratios.push_back((a[i] + a[i + 1] + a[i + 2]) / was);
  }
  return ratios.empty() ? 0 : median(ratios);
}

}  // namespace

/// Fixed lamps of which a part is seen are whole again.
void LightTracker::restore_cut(Illumination& now) const {
  for (const auto& [id, fixed] : fixed_) {
    if (fixed.images < kCovered.settled_images) continue;
    const PointLight& whole = fixed.light;
    const auto inside = [&](const PointLight& lamp) {
      return lamp.clipped == whole.clipped && lamp.lamp_tag < 0 &&
             angle_between(lamp.direction, whole.direction) < kCovered.outline * whole.angular_radius_rad;
    };
    std::vector<const PointLight*> parts;
    for (const PointLight& lamp : now.lights) {
      if (inside(lamp)) parts.push_back(&lamp);
    }
    if (parts.empty() || !is_cut(whole, parts)) continue;
    std::erase_if(now.lights, inside);
    now.lights.push_back(whole);
    now.lights.back().covered = true;
  }
}

/// Fixed lamps that are gone while the room is lit as before are covered.
void LightTracker::restore_missing(const Illumination& last, std::vector<int>& found, Illumination& now) const {
  const std::size_t seen = found.size();
  std::optional<float> change;
  for (std::size_t j = 0; j < last.lights.size(); ++j) {
    const auto fixed = fixed_.find(last.lights[j].id);
    if (fixed == fixed_.end() || fixed->second.images < kCovered.settled_images || last.lights[j].hidden > 0) continue;
    if (std::find(found.begin(), found.end(), static_cast<int>(j)) != found.end()) continue;
    const PointLight& lamp = fixed->second.light;
    bool elsewhere = false;
    for (std::size_t i = 0; i < seen; ++i) elsewhere |= found[i] < 0 && alike(now.lights[i], lamp);
    const float all = mean_irradiance(last, last.probe_position_m).mean(), share = lamp.irradiance.mean() / 4 / all;
    if (elsewhere || !(share > kCovered.min_share) || now.lights.size() >= max_lamps_) continue;
    if (!change) change = median_change(now.environment, uncovered_);
    if (*change < 1 - (1 - kCovered.min_lit_fraction) * share) continue;
    now.lights.push_back(lamp);
    now.lights.back().covered = true;
    found.push_back(static_cast<int>(j));
  }
}

void LightTracker::remember_fixed(const Illumination& now) {
  bool all_seen = true;
  for (const PointLight& lamp : now.lights) {
    all_seen &= lamp.hidden == 0 && !lamp.covered;
    if (lamp.hidden > 0 || lamp.covered || lamp.lamp_tag >= 0 || lamp.region >= 0) continue;
    Fixed& fixed = fixed_[lamp.id];
    const float size = fixed.images > 0 ? solid_angle_sr(lamp) / solid_angle_sr(fixed.light) : 0;
    const bool same = std::abs(size - 1) < kCovered.min_fraction && lamp.clipped == fixed.light.clipped &&
                      angle_between(lamp.direction, fixed.light.direction) < kTracking.max_still_angle_rad;
    fixed.images = same ? std::min(fixed.images + 1, kCovered.settled_images) : 1;
    // Else a lamp that is covered slowly would shrink unnoticed.
    if (!same || size >= 1) fixed.light = lamp;
    fixed.light.irradiance = lamp.irradiance * (solid_angle_sr(fixed.light) / solid_angle_sr(lamp));
    fixed.light.id = lamp.id;
  }
  std::erase_if(fixed_, [&](const auto& entry) { return !lamp_with_id(now.lights, entry.first); });
  if (all_seen) uncovered_ = now.environment;
}

void LightTracker::hold_missing(const Illumination& last, const std::vector<int>& found, Illumination& now) {
  std::vector<bool> seen(last.lights.size(), false);
  for (const int j : found) {
    if (j >= 0) seen[static_cast<std::size_t>(j)] = true;
  }
  double missing = energy(last) - energy(now);
  std::map<int, int> held;  // new regions of held pieces, by their last ones
  for (std::size_t j = 0; j < last.lights.size(); ++j) {
    PointLight lamp = last.lights[j];
    const double energy_of_lamp = lamp.irradiance.mean();
    if (seen[j] || missing < kTracking.min_missing_fraction * energy_of_lamp ||
        lamp.hidden >= kTracking.held_frames + kTracking.fade_frames - 1)
      continue;
    if (now.lights.size() >= max_lamps_) break;
    missing -= energy_of_lamp;
    if (lamp.region >= 0 && lamp.hidden == 0) {
      const auto [region, is_new] = held.try_emplace(lamp.region, next_held_region_);
      if (is_new) ++next_held_region_;
      lamp.region = region->second;
    }
    // Equal steps down to zero.
    const int steps_left = kTracking.held_frames + kTracking.fade_frames - lamp.hidden;
    if (++lamp.hidden > kTracking.held_frames) lamp.irradiance *= (steps_left - 1.0f) / steps_left;
    now.lights.push_back(lamp);
  }
}

int LightTracker::id_of_tag(int lamp_tag, const std::vector<PointLight>& lights) {
  const auto [entry, is_new] = ids_of_tags_.try_emplace(lamp_tag, next_id_);
  const int id = entry->second;
  if (is_new || std::any_of(lights.begin(), lights.end(),
                            [&](const PointLight& light) { return light.id == id && light.lamp_tag != lamp_tag; }))
    entry->second = next_id_++;
  return entry->second;
}

/// The id of the nearest earlier lamp that is not in use; -1 if none is near.
int LightTracker::earlier_id(const PointLight& light, const std::vector<PointLight>& before,
                             const std::set<int>& taken) const {
  int nearest = -1;
  float min_angle = kTracking.max_lamp_angle_rad;
  for (const auto& [id, direction] : last_directions_) {
    const float angle = angle_between(direction, light.direction);
    const bool in_use = taken.contains(id) || std::any_of(before.begin(), before.end(),
                                                          [id = id](const PointLight& b) { return b.id == id; });
    if (angle >= min_angle || in_use) continue;
    min_angle = angle;
    nearest = id;
  }
  return nearest;
}

/// Lamps keep their ids; one with a tag has the id of the tag, which is the lamp's id from before it had the tag.
void LightTracker::assign_ids(const std::vector<PointLight>& before, const std::vector<int>& found,
                              std::vector<PointLight>& lights) {
  std::set<int> taken;
  const auto old_id = [&](std::size_t i) { return found[i] < 0 ? -1 : before[static_cast<std::size_t>(found[i])].id; };
  const auto tagged = [&](std::size_t i) {  // pieces of one lamp cannot share an id
    return lights[i].lamp_tag >= 0 && lights[i].region < 0;
  };
  for (std::size_t i = 0; i < lights.size(); ++i) {
    if (!tagged(i)) continue;
    if (old_id(i) >= 0) ids_of_tags_.try_emplace(lights[i].lamp_tag, old_id(i));
    lights[i].id = id_of_tag(lights[i].lamp_tag, {});
    taken.insert(lights[i].id);
  }
  for (std::size_t i = 0; i < lights.size(); ++i) {
    if (tagged(i)) continue;
    int id = old_id(i) >= 0 && !taken.contains(old_id(i)) ? old_id(i) : earlier_id(lights[i], before, taken);
    if (id < 0) id = next_id_++;
    lights[i].id = id;
    taken.insert(id);
    last_directions_[id] = lights[i].direction;
  }
  while (last_directions_.size() > kTracking.max_remembered) last_directions_.erase(last_directions_.begin());
}

void LightTracker::update(const Illumination* last, Illumination& now) {
  const std::vector<PointLight> none;
  const std::vector<PointLight>& before = last ? last->lights : none;
  restore_cut(now);
  std::vector<int> found = match(now.lights, before);
  if (last) restore_missing(*last, found, now);
  bool all_still = last && now.lights.size() == before.size() && still(now.environment_sh, last->environment_sh);
  assign_ids(before, found, now.lights);
  for (std::size_t i = 0; i < now.lights.size(); ++i) {
    all_still = all_still && found[i] >= 0 && still(now.lights[i], before[static_cast<std::size_t>(found[i])]);
  }
  if (last && !all_still) hold_missing(*last, found, now);
  averaged_ = all_still ? std::min(averaged_ + 1, kTracking.max_averaged) : 1;
  if (averaged_ > 1) average(*last, found, now);
  remember_fixed(now);
}

void LightTracker::average(const Illumination& last, const std::vector<int>& found, Illumination& now) const {
  const float a = 1.0f / static_cast<float>(averaged_), b = 1 - a;
  for (std::size_t i = 0; i < now.lights.size(); ++i) {
    PointLight& light = now.lights[i];
    const PointLight& old = last.lights[static_cast<std::size_t>(found[i])];
    light.direction = (a * light.direction + b * old.direction).normalized();
    light.irradiance = a * light.irradiance + b * old.irradiance;
    light.angular_radius_rad = a * light.angular_radius_rad + b * old.angular_radius_rad;
    light.outline_u = a * light.outline_u + b * old.outline_u;
    light.outline_v = a * light.outline_v + b * old.outline_v;
  }
  for (std::size_t i = 0; i < now.environment.radiance.data.size(); ++i) {
    now.environment.radiance.data[i] = a * now.environment.radiance.data[i] + b * last.environment.radiance.data[i];
  }
  for (std::size_t i = 0; i < now.environment_sh.size(); ++i) {
    now.environment_sh[i] = a * now.environment_sh[i] + b * last.environment_sh[i];
  }
}

}  // namespace lumigraft::reconstruct
