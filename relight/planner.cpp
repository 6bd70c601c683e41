#include "relight/planner.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "reconstruct/light/environment.h"
#include "relight/animation/skinning.h"
#include "relight/parameters.h"

namespace lumigraft::relight {
namespace {

/// Fraction of each lamp in all light at a point; strongest at the probe first, the order in which they are rendered.
std::vector<float> lamp_fractions(const std::vector<reconstruct::PointLight>& lamps, const Eigen::Vector3f* place_m,
                                  float environment) {
  std::vector<float> fractions;
  float sum = environment;
  for (const reconstruct::PointLight& lamp : lamps) {
    float irradiance = lamp.irradiance.mean();
    if (place_m && lamp.distance_known) {
      const Eigen::Vector3f from = *place_m - lamp.position_m;
      const float distance_m = std::max(from.norm(), std::max(lamp.radius_m, 1e-3f));
      irradiance = lamp.intensity.mean() * lamp.emission(from / distance_m) / (distance_m * distance_m);
    }
    fractions.push_back(irradiance);
    sum += irradiance;
  }
  for (float& fraction : fractions) fraction = sum > 0 ? fraction / sum : 0;
  return fractions;
}

}  // namespace

LightMeasures measure_light(const reconstruct::Illumination& light) {
  LightMeasures measures;
  const capture::Image<float>& rest = light.environment.radiance;
  double environment = 0;
  for (int v = 0; v < rest.height; ++v) {
    const double solid_angle = reconstruct::environment_solid_angle_sr(v, rest.width, rest.height) / 3;
    for (int u = 0; u < rest.width; ++u)
      for (int c = 0; c < 3; ++c) environment += solid_angle * rest.at(u, v, c);
  }
  double all = environment;
  for (const reconstruct::PointLight& lamp : light.lights) all += lamp.irradiance.mean();
  const double scale = all > 0 ? 1 / all : 0;
  measures.environment_fraction = static_cast<float>(scale * environment);

  // In the mean square over the sphere the bands add up, as their functions are orthonormal (Ramamoorthi & Hanrahan
  // 2001, eq. 7, 8).
  constexpr std::array kCosine = {std::numbers::pi_v<float>, 2 * std::numbers::pi_v<float> / 3,
                                  std::numbers::pi_v<float> / 4};
  std::array<float, 3> energy{};
  for (std::size_t i = 0; i < light.environment_sh.size(); ++i) {
    const std::size_t band = i == 0 ? 0 : i < 4 ? 1 : 2;
    energy[band] += (kCosine[band] * light.environment_sh[i]).squaredNorm();
  }
  // The mean of a source's irradiance over all normals is a quarter of its fluence at the point.
  const auto mean = static_cast<float>(all / 4);
  float higher = 0;
  for (std::size_t band = energy.size(); band-- > 1;) {
    higher += energy[band];
    measures.bands_left_out[band - 1] = mean > 0 ? std::sqrt(higher / (12 * std::numbers::pi_v<float>)) / mean : 0;
  }
  return measures;
}

/// The smallest value that keeps to the bound; the largest if none does.
int Planner::Held::hold(const std::vector<float>& left_out) {
  const auto smallest_within = [&](float bound) {
    const auto found = std::find_if(left_out.begin(), left_out.end(), [&](float part) { return part <= bound; });
    return std::min(static_cast<int>(found - left_out.begin()), static_cast<int>(left_out.size()) - 1);
  };
  const int safe = smallest_within(0.5f * kRelight.max_left_out);
  if (value < 0) {
    value = smallest_within(kRelight.max_left_out);
  } else if (value >= static_cast<int>(left_out.size()) ||
             left_out[static_cast<std::size_t>(value)] > kRelight.max_left_out) {
    value = safe;
    calm = 0;
  } else if (safe < value && ++calm >= kRelight.calm_frames) {
    value = safe;
    calm = 0;
  } else if (safe >= value) {
    calm = 0;
  }
  return value;
}

Eigen::Vector3f Planner::middle_of(const VirtualObject& object, double time_s) {
  if (const RigPose pose = object.pose(time_s); !pose.at_rest()) {
    const BoundingSphere sphere = bounding_sphere(skinned(*object.model->rig, pose).positions_m);
    return (object.T_tag_model(time_s) * sphere.centre_m.cast<double>()).cast<float>();
  }
  auto known = spheres_.find(object.model);
  if (known == spheres_.end()) known = spheres_.emplace(object.model, bounding_sphere(object.model->positions_m)).first;
  return (object.T_tag_model(time_s) * known->second.centre_m.cast<double>()).cast<float>();
}

/// By the number of rendered lamps: the maximum over all points of the fraction that the other lamps contribute.
std::vector<float> Planner::fractions_left_out(const reconstruct::Illumination& light, const Exhibit& exhibit,
                                               double time_s) {
  std::vector<reconstruct::PointLight> lamps = light.lights;
  std::stable_sort(lamps.begin(), lamps.end(), [](const reconstruct::PointLight& a, const reconstruct::PointLight& b) {
    return a.irradiance.sum() > b.irradiance.sum();
  });
  float lamps_at_probe = 0;
  for (const reconstruct::PointLight& lamp : lamps) lamps_at_probe += lamp.irradiance.mean();
  const float fraction = measures_.environment_fraction;
  const float environment = fraction < 1 ? lamps_at_probe * fraction / (1 - fraction) : 1;
  std::vector<std::vector<float>> places{lamp_fractions(lamps, nullptr, environment)};
  for (const VirtualObject& object : exhibit.objects) {
    if (!object.visible || !object.model) continue;
    const Eigen::Vector3f place_m = middle_of(object, time_s);
    places.push_back(lamp_fractions(lamps, &place_m, environment));
  }
  std::vector<float> left_out(lamps.size() + 1, 0);
  for (const std::vector<float>& fractions : places) {
    float rest = 0;
    for (std::size_t drawn = lamps.size(); drawn-- > 0;) {
      rest += fractions[drawn];
      left_out[drawn] = std::max(left_out[drawn], rest);
    }
  }
  return left_out;
}

Planner::Decision Planner::decide(const reconstruct::Scene& scene, const Exhibit& exhibit, double time_s) {
  Decision decision{asked_, {}};
  if (asked_.adaptive == 0 || !asked_.on_device() || !scene.illumination) return decision;
  if (measured_ != scene.illumination) {
    measured_ = scene.illumination;
    measures_ = measure_light(*measured_);
  }
  const auto take = [&](const char* key, int Plan::*value, Held& held, const std::vector<float>& left_out, int first) {
    if (asked_.user_set.contains(key)) return;
    const int requested = asked_.*value;
    const int taken = std::min(held.hold(left_out) + first, requested);
    const auto at = std::min(static_cast<std::size_t>(std::max(taken - first, 0)), left_out.size() - 1);
    decision.plan.*value = taken;
    decision.choices.push_back({key, requested, taken, left_out[at]});
  };
  if (!asked_.user_set.contains("rsm") && !asked_.in_cells()) {
    decision.plan.rsm = std::min(asked_.rsm, 2 * asked_.volume);
    decision.choices.push_back({"rsm", asked_.rsm, decision.plan.rsm, 0});
  }
  take("max_lights", &Plan::max_lights, lights_, fractions_left_out(*measured_, exhibit, time_s), 0);
  take("sh_bands", &Plan::sh_bands, bands_, {measures_.bands_left_out.begin(), measures_.bands_left_out.end()}, 1);
  return decision;
}

}  // namespace lumigraft::relight
