#include "reconstruct/light/tracking.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <vector>

#include "reconstruct/light/environment.h"

namespace lumigraft::reconstruct {
namespace {

constexpr float kSameLampRad = 0.1f;  // between two pictures
constexpr float kMarked = 10;         // a mark says more than any angle
constexpr float kStillRad = 0.009f;   // about a pixel and a half of a 512-pixel fish-eye
constexpr float kStillShare = 0.1f;   // of a lamp's irradiance
constexpr int kLongestMean = 10;      // pictures
constexpr double kGone = 0.5;         // of a lamp's energy must be missing in the picture for it to be hidden

struct Match {
  float angle;
  std::size_t now, last;
};

float angle_between(const PointLight& a, const PointLight& b) {
  return std::acos(std::clamp(a.direction.dot(b.direction), -1.0f, 1.0f));
}

/// For each lamp of `now` the index of its lamp in `last`, or -1: those with the same mark, then nearest pairs first.
std::vector<int> match(const std::vector<PointLight>& now, const std::vector<PointLight>& last) {
  std::vector<Match> pairs;
  for (std::size_t i = 0; i < now.size(); ++i) {
    for (std::size_t j = 0; j < last.size(); ++j) {
      const bool marked = now[i].mark >= 0 && last[j].mark >= 0, same = marked && now[i].mark == last[j].mark;
      const float angle = angle_between(now[i], last[j]);
      if (same || (!marked && angle < kSameLampRad)) pairs.push_back({same ? angle - kMarked : angle, i, j});
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
  return now.mark == last.mark && angle_between(now, last) < kStillRad && now.clipped == last.clipped &&
         (now.irradiance - last.irradiance).norm() < kStillShare * last.irradiance.norm();
}

/// ∫ L dω, mean of channels.
double energy(const Illumination& light) {
  double sum = 0;
  for (const PointLight& lamp : light.lights) sum += lamp.irradiance.mean();
  const capture::Image<float>& rest = light.environment.radiance;
  for (int v = 0; v < rest.height; ++v) {
    double row = 0;
    for (int u = 0; u < rest.width; ++u) row += (rest.at(u, v, 0) + rest.at(u, v, 1) + rest.at(u, v, 2)) / 3;
    sum += row * environment_solid_angle_sr(v, rest.width, rest.height);
  }
  return sum;
}

}  // namespace

void LightTracker::keep_hidden(const Illumination& last, const std::vector<int>& found, Illumination& now) {
  std::vector<bool> seen(last.lights.size(), false);
  for (const int j : found) {
    if (j >= 0) seen[static_cast<std::size_t>(j)] = true;
  }
  double missing = energy(last) - energy(now);
  std::map<int, int> held;  // regions of the last picture
  for (std::size_t j = 0; j < last.lights.size(); ++j) {
    PointLight lamp = last.lights[j];
    const double share = lamp.irradiance.mean();
    if (seen[j] || missing < kGone * share || lamp.hidden >= kHeld + kFaded - 1) continue;
    if (now.lights.size() >= most_) break;
    missing -= share;
    if (lamp.region >= 0 && lamp.hidden == 0) {
      const auto [region, is_new] = held.try_emplace(lamp.region, next_held_region_);
      if (is_new) ++next_held_region_;
      lamp.region = region->second;
    }
    // What is left falls in even steps to none.
    const int steps_left = kHeld + kFaded - lamp.hidden;
    if (++lamp.hidden > kHeld) lamp.irradiance *= (steps_left - 1.0f) / steps_left;
    now.lights.push_back(lamp);
  }
}

int LightTracker::id_of_mark(int mark, const std::vector<PointLight>& lights) {
  const auto [entry, is_new] = ids_of_marks_.try_emplace(mark, next_id_);
  const int id = entry->second;
  if (is_new || std::any_of(lights.begin(), lights.end(),
                            [&](const PointLight& light) { return light.id == id && light.mark != mark; }))
    entry->second = next_id_++;
  return entry->second;
}

/// Lamps get the ids they had before; one with a mark that of the mark, which is the one it had when it got the mark.
void LightTracker::name(const std::vector<PointLight>& before, const std::vector<int>& found,
                        std::vector<PointLight>& lights) {
  std::set<int> taken;
  const auto old_id = [&](std::size_t i) { return found[i] < 0 ? -1 : before[static_cast<std::size_t>(found[i])].id; };
  const auto marked = [&](std::size_t i) {  // pieces of one lamp cannot share an id
    return lights[i].mark >= 0 && lights[i].region < 0;
  };
  for (std::size_t i = 0; i < lights.size(); ++i) {
    if (!marked(i)) continue;
    if (old_id(i) >= 0) ids_of_marks_.try_emplace(lights[i].mark, old_id(i));
    lights[i].id = id_of_mark(lights[i].mark, {});
    taken.insert(lights[i].id);
  }
  for (std::size_t i = 0; i < lights.size(); ++i) {
    if (marked(i)) continue;
    lights[i].id = old_id(i) >= 0 && !taken.contains(old_id(i)) ? old_id(i) : next_id_++;
  }
}

void LightTracker::update(const Illumination* last, Illumination& now) {
  const std::vector<PointLight> none;
  const std::vector<PointLight>& before = last ? last->lights : none;
  const std::vector<int> found = match(now.lights, before);
  bool all_still = last && now.lights.size() == before.size();
  name(before, found, now.lights);
  for (std::size_t i = 0; i < now.lights.size(); ++i) {
    all_still = all_still && found[i] >= 0 && still(now.lights[i], before[static_cast<std::size_t>(found[i])]);
  }
  if (last && !all_still) keep_hidden(*last, found, now);
  averaged_ = all_still ? std::min(averaged_ + 1, kLongestMean) : 1;
  if (averaged_ == 1) return;

  const float a = 1.0f / averaged_, b = 1 - a;
  for (std::size_t i = 0; i < now.lights.size(); ++i) {
    PointLight& light = now.lights[i];
    const PointLight& old = before[static_cast<std::size_t>(found[i])];
    light.direction = (a * light.direction + b * old.direction).normalized();
    light.irradiance = a * light.irradiance + b * old.irradiance;
    light.angular_radius_rad = a * light.angular_radius_rad + b * old.angular_radius_rad;
  }
  for (std::size_t i = 0; i < now.environment.radiance.data.size(); ++i) {
    now.environment.radiance.data[i] = a * now.environment.radiance.data[i] + b * last->environment.radiance.data[i];
  }
  for (std::size_t i = 0; i < now.environment_sh.size(); ++i) {
    now.environment_sh[i] = a * now.environment_sh[i] + b * last->environment_sh[i];
  }
}

}  // namespace lumigraft::reconstruct
