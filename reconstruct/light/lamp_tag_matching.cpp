#include "reconstruct/light/lamp_tag_matching.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "reconstruct/light/lamp_merge.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

constexpr float kDegree = std::numbers::pi_v<float> / 180;
constexpr float kFisheye_rad = 0.005f;     ///< 1σ of a lamp's direction in the picture: lens and pose of the fish-eye
constexpr float kLoose_rad = 2 * kDegree;  ///< beyond what is unsure: the middle of what glows is not quite the lamp's
constexpr float kNear_deg = 20;            ///< a lamp so near to a dark place may be the one that is meant
constexpr float kKnownPower = 0.1f;        ///< 1σ of log intensity that was configured, or seen
constexpr float kLess = 0.8f;              ///< of what is seen at least: a configured intensity that is less is wrong
constexpr float kFaint = 1e-3f;            ///< of all light at the probe: a lamp of which no power is known
constexpr float kRim_rad = 1 * kDegree;    ///< the picture's end shows no lamp well
constexpr float kNearest_m = 0.05f;        ///< to the fish-eye: no lamp stands in it
constexpr float kFacing = 0.05f;           ///< cosine below which a panel does not show its face

float angle_between(const Vector3f& a, const Vector3f& b) { return std::acos(std::clamp(a.dot(b), -1.0f, 1.0f)); }

/// Irradiance at the probe over intensity straight ahead, but for the square of the distance.
float slant(const PointLight& lamp) { return lamp.flat ? std::max(-lamp.normal.dot(lamp.direction), kLeastSlant) : 1; }

struct Way {
  Vector3f direction;  ///< unit
  float distance_m;
};
Way way_to(const LampTagPose& mark, const Vector3f& probe_m) {
  const Vector3f to = mark.position_m - probe_m;
  return {to.stableNormalized(), std::max(to.norm(), kNearest_m)};
}

const LampTagPose* mark_of(const std::vector<LampTagPose>& marks, int lamp) {
  const auto found =
      std::find_if(marks.begin(), marks.end(), [&](const LampTagPose& mark) { return mark.lamp == lamp; });
  return found == marks.end() ? nullptr : &*found;
}

bool has_mark(const std::vector<PointLight>& lights, int mark) {
  return std::any_of(lights.begin(), lights.end(), [&](const PointLight& light) { return light.mark == mark; });
}

/// How far from the mark's direction its lamp may be seen.
float gate_rad(const LampTagPose& mark, float distance_m, const PointLight& light) {
  return kLoose_rad + 3 * std::atan(mark.sigma_m / distance_m) + 0.5f * light.angular_radius_rad;
}

/// ∫ L dω of all that is seen, mean of channels.
float all_light(const Illumination& seen) {
  float sum = seen.environment_sh[0].mean() * std::sqrt(4 * std::numbers::pi_v<float>);
  for (const PointLight& light : seen.lights) sum += light.irradiance.mean();
  return std::max(sum, 1e-6f);
}

std::string dark_warning(const std::string& name, const std::vector<PointLight>& lights, const Vector3f& direction) {
  float nearest_deg = kNear_deg;
  for (const PointLight& light : lights)
    if (light.mark < 0) nearest_deg = std::min(nearest_deg, angle_between(light.direction, direction) / kDegree);
  std::string text = "lamp " + name + ": no light is seen where its tag says that it is: off, or hidden";
  if (nearest_deg >= kNear_deg) return text;
  char more[120];
  std::snprintf(more, sizeof more, "; or it is the one %.0f degrees beside, and position_m or tag_size_m is wrong",
                nearest_deg);
  return text + more;
}

}  // namespace

TaggedLights::TaggedLights(const capture::Session& session)
    : lamps_(session.lamps), camera_(session.fisheye), powers_(session.lamps.size()) {}

void TaggedLights::identify(const std::vector<LampTagPose>& marks, std::vector<PointLight>& lights,
                            const Vector3f& probe_m) const {
  struct Pair {
    float angle;
    std::size_t whole;
    int mark;
  };
  const std::vector<PointLight> joined = join_pieces(lights);
  std::vector<Pair> pairs;
  for (const LampTagPose& mark : marks) {
    if (has_mark(lights, mark.lamp)) continue;
    const auto [by_mark, distance_m] = way_to(mark, probe_m);
    for (std::size_t i = 0; i < joined.size(); ++i) {
      if (joined[i].mark >= 0 || joined[i].hidden > 0) continue;
      const float angle = angle_between(joined[i].direction, by_mark);
      if (angle < gate_rad(mark, distance_m, joined[i])) pairs.push_back({angle, i, mark.lamp});
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) { return a.angle < b.angle; });
  std::vector<bool> taken(joined.size(), false);
  for (const Pair& pair : pairs) {
    if (taken[pair.whole] || has_mark(lights, pair.mark)) continue;
    taken[pair.whole] = true;
    const PointLight& whole = joined[pair.whole];
    for (PointLight& light : lights)
      if (whole.region < 0 ? light.id == whole.id : light.region == whole.region) light.mark = pair.mark;
  }
}

bool TaggedLights::in_view(const Vector3f& position_m) const {
  if (!camera_) return false;
  const Eigen::Vector3d p = camera_->T_tag_fisheye.inverse() * position_m.cast<double>();
  const double from_axis = std::atan2(p.head<2>().norm(), p.z());
  const auto pixel = camera_->model.project(p);
  return pixel && from_axis < 0.5 * camera_->model.fov_rad - kRim_rad && pixel->x() > 0 && pixel->y() > 0 &&
         pixel->x() < camera_->model.width - 1 && pixel->y() < camera_->model.height - 1;
}

void TaggedLights::place_seen(PointLight& lamp, const LampTagPose& mark, const Vector3f& probe_m) {
  const capture::TaggedLamp& configured = lamps_[static_cast<std::size_t>(mark.lamp)];
  Power& power = powers_[static_cast<std::size_t>(mark.lamp)];
  const auto [by_mark, distance_m] = way_to(mark, probe_m);
  // A picture that is older than the mark, since the fish-eye is covered, tells no direction.
  const bool elsewhere = angle_between(lamp.direction, by_mark) > gate_rad(mark, distance_m, lamp);
  if (elsewhere) {
    lamp.direction = by_mark;
  } else if (lamp.region < 0) {
    const float of_mark = mark.sigma_m / distance_m;
    const float share = of_mark * of_mark / (of_mark * of_mark + kFisheye_rad * kFisheye_rad);
    lamp.direction = (share * lamp.direction + (1 - share) * by_mark).normalized();
  }
  if (lamp.region < 0) lamp.angular_radius_rad = std::atan(static_cast<float>(configured.radius_m) / distance_m);
  lamp.distance_known = true;
  lamp.distance_log_sigma = mark.sigma_m / distance_m;
  lamp.position_m = probe_m + distance_m * lamp.direction;
  lamp.flat = configured.normal.has_value();
  lamp.normal = mark.normal;
  const float fall = slant(lamp) / (distance_m * distance_m);
  if (elsewhere && power.seen && lamp.hidden == 0) lamp.irradiance = *power.seen * fall;
  if (lamp.clipped && configured.intensity && (*configured.intensity * fall).sum() > kLess * lamp.irradiance.sum()) {
    lamp.irradiance = *configured.intensity * fall;
    lamp.clipped = false;
    lamp.power_log_sigma = kKnownPower;
  }
  if (!lamp.clipped && lamp.hidden == 0) power.seen = lamp.irradiance / fall;
  lamp.intensity = lamp.irradiance * distance_m * distance_m;
  lamp.radius_m = distance_m * std::tan(lamp.angular_radius_rad);
}

PointLight TaggedLights::unseen(const LampTagPose& mark, const Illumination& seen, std::vector<std::string>& warnings) {
  const capture::TaggedLamp& configured = lamps_[static_cast<std::size_t>(mark.lamp)];
  Power& power = powers_[static_cast<std::size_t>(mark.lamp)];
  PointLight lamp;
  lamp.mark = mark.lamp;
  const auto [direction, distance_m] = way_to(mark, seen.probe_position_m);
  lamp.direction = direction;
  lamp.position_m = mark.position_m;
  lamp.radius_m = static_cast<float>(configured.radius_m);
  lamp.angular_radius_rad = std::atan(lamp.radius_m / distance_m);
  lamp.distance_known = true;
  lamp.distance_log_sigma = mark.sigma_m / distance_m;
  lamp.flat = configured.normal.has_value();
  lamp.normal = mark.normal;
  const bool turned_away = lamp.flat && -lamp.normal.dot(lamp.direction) < kFacing;
  lamp.shown = in_view(mark.position_m) && !turned_away ? PointLight::Shown::dark : PointLight::Shown::outside;
  const float fall = slant(lamp) / (distance_m * distance_m);
  const std::optional<Vector3f> known = power.seen ? power.seen : configured.intensity;
  if (lamp.shown == PointLight::Shown::dark)
    warnings.push_back(dark_warning(configured.name, seen.lights, lamp.direction));
  if (lamp.shown == PointLight::Shown::outside && known) {
    lamp.irradiance = *known * fall;
    lamp.power_log_sigma = kKnownPower;
  } else {
    if (!power.guess) power.guess = Vector3f::Constant(kFaint * all_light(seen) / fall);
    lamp.irradiance = *power.guess * fall;
    lamp.power_log_sigma = kUnknownPower;
  }
  lamp.intensity = lamp.irradiance * distance_m * distance_m;
  return lamp;
}

TaggedLights::Result TaggedLights::place(const Illumination& seen, const std::vector<LampTagPose>& marks,
                                         const std::function<int(int)>& id_of) {
  Result result;
  std::vector<PointLight> lights = seen.lights;
  for (PointLight& light : lights)
    if (!mark_of(marks, light.mark)) light.mark = -1;
  // One that is held since it may be covered, and whose tag says that it left the picture, is not covered.
  std::erase_if(lights, [&](const PointLight& light) {
    return light.hidden > 0 && light.mark >= 0 && !in_view(mark_of(marks, light.mark)->position_m);
  });
  const std::vector<PointLight> joined = join_pieces(lights);
  std::vector<PointLight> placed = joined;
  for (PointLight& whole : placed)
    if (whole.mark >= 0) place_seen(whole, *mark_of(marks, whole.mark), seen.probe_position_m);
  result.lights = place_pieces(lights, joined, placed, seen.probe_position_m);
  for (PointLight& light : result.lights) {
    const auto whole = std::find_if(placed.begin(), placed.end(),
                                    [&](const PointLight& p) { return light.mark >= 0 && p.mark == light.mark; });
    if (whole == placed.end()) continue;
    if (light.region < 0)
      light = *whole;
    else
      light.clipped = whole->clipped;
  }
  for (const LampTagPose& mark : marks) {
    if (has_mark(lights, mark.lamp)) continue;
    result.lights.push_back(unseen(mark, seen, result.warnings));
    result.lights.back().id = id_of(mark.lamp);
  }
  return result;
}

bool same_places(const std::vector<PointLight>& a, const std::vector<PointLight>& b) {
  constexpr float kPlace_m = 0.002f, kShare = 0.01f, kTurn = 0.01f;
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const PointLight& p, const PointLight& q) {
    return p.id == q.id && p.mark == q.mark && p.shown == q.shown && p.clipped == q.clipped && p.flat == q.flat &&
           p.distance_known == q.distance_known && (p.position_m - q.position_m).norm() < kPlace_m &&
           (p.irradiance - q.irradiance).norm() <= kShare * q.irradiance.norm() && (p.normal - q.normal).norm() < kTurn;
  });
}

}  // namespace lumigraft::reconstruct
