#include "reconstruct/lamps/light_from_shading.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "reconstruct/field/field_rays.h"
#include "reconstruct/lamps/parameters.h"
#include "reconstruct/lamps/shading_fit.h"
#include "reconstruct/light/environment.h"
#include "reconstruct/light/parameters.h"
#include "reconstruct/math/tag_family.h"
#include "reconstruct/shading/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Array3f;
using Eigen::Vector3f;

constexpr const LampParameters::FromShading& kFromShading = kLampParameters.from_shading;
constexpr double kInfinite = std::numeric_limits<double>::infinity();
/// Above all versions of the fish-eye's light, as one must not be taken for the other.
constexpr std::uint64_t kFirstVersion = std::uint64_t{1} << 32;

struct Explanation {
  std::vector<SupposedLamp> lamps;
  double cost = kInfinite;
};

class LampsFromShading {
 public:
  explicit LampsFromShading(ShadingFit& fit) : fit_(fit) {}

  /// None if uniform light explains the shading about as well.
  std::vector<SupposedLamp> find() {
    Explanation best{{}, fit_.cost({})};
    if (fit_.pairs() > 0) fill_grid();
    while (!grid_.empty() && best.lamps.size() < kFromShading.max_lamps) {
      Explanation more = best;
      more.lamps.emplace_back();
      more = search(more.lamps, best.lamps.size());
      if (!worthwhile(more, best, kFromShading.max_first_cost)) break;
      more = refine(descend(std::move(more)));
      if (!worthwhile(more, best, kFromShading.max_cost)) break;
      best = std::move(more);
    }
    return best.lamps;
  }

 private:
  /// Directions evenly spread over the sphere (Fibonacci's lattice).
  void fill_grid() {
    for (int i = 0; i < kFromShading.directions; ++i) {
      const float z = 1 - static_cast<float>(2 * i + 1) / kFromShading.directions, r = std::sqrt(1 - z * z);
      const float phi = std::numbers::pi_v<float> * (3 - std::sqrt(5.0f)) * static_cast<float>(i);
      for (const float distance_m : kFromShading.distances_m) {
        for (const bool flat : {false, true}) {
          SupposedLamp lamp{{r * std::cos(phi), r * std::sin(phi), z}, distance_m, flat};
          if (fit_.is_excluded(lamp)) break;
          fit_.tabulate(lamp, 1);
          grid_.push_back(std::move(lamp));
        }
      }
    }
  }

  bool worthwhile(const Explanation& more, const Explanation& less, double max_cost) const {
    return more.cost < max_cost * less.cost &&
           less.cost - more.cost > kFromShading.min_gain * static_cast<double>(fit_.pairs());
  }

  /// Coordinate descent over the powers of all lamps: all channels together, then one by one.
  Explanation with_best_powers(Explanation found, std::span<const float> log_steps) {
    found.cost = fit_.cost(found.lamps);
    for (const float step : log_steps) {
      for (SupposedLamp& lamp : found.lamps) {
        for (int channel = -1; channel < 3; ++channel) {
          for (const float factor : {std::exp(step), std::exp(-step)}) {
            const Array3f before = lamp.power;
            if (channel < 0)
              lamp.power *= factor;
            else
              lamp.power[channel] *= factor;
            const double now = fit_.cost(found.lamps);
            if (now < found.cost) {
              found.cost = now;
              break;
            }
            lamp.power = before;
          }
        }
      }
    }
    return found;
  }

  /// The best white power of lamp k, searched downhill from e to the power of `log_power`, which is set.
  double best_power(std::vector<SupposedLamp>& lamps, std::size_t k, int& log_power) {
    const auto cost_at = [&](int log_power_there) {
      lamps[k].power = Array3f::Constant(std::exp(static_cast<float>(log_power_there)));
      return fit_.cost(lamps);
    };
    const int start = log_power;
    double best = cost_at(start);
    for (const int step : {1, -1}) {
      while (std::abs(log_power + step) <= kFromShading.max_log_power) {
        const double next = cost_at(log_power + step);
        if (!(next < best)) break;
        best = next;
        log_power += step;
      }
      if (log_power != start) break;
    }
    lamps[k].power = Array3f::Constant(std::exp(static_cast<float>(log_power)));
    return best;
  }

  /// The best of the grid for lamp k. Of the others only the powers change.
  Explanation search(std::vector<SupposedLamp> lamps, std::size_t k) {
    std::vector<std::pair<double, SupposedLamp>> found;
    int log_power = 0;  // neighbours on the grid have about equal powers
    for (const SupposedLamp& there : grid_) {
      lamps[k] = there;
      const double cost = best_power(lamps, k, log_power);
      found.emplace_back(cost, lamps[k]);
    }
    const std::size_t count = std::min(found.size(), kFromShading.finalists);
    std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(count), found.end(),
                      [](const auto& a, const auto& b) { return a.first < b.first; });
    Explanation best;
    for (std::size_t i = 0; i < count; ++i) {
      lamps[k] = found[i].second;
      Explanation fitted = with_best_powers({lamps}, kFromShading.rough_log_steps);
      if (fitted.cost < best.cost) best = std::move(fitted);
    }
    return best;
  }

  /// Searches each lamp again, while that helps: the first was found as if it were the only one.
  Explanation descend(Explanation best) {
    bool better = best.lamps.size() > 1;
    for (int round = 0; better && round < kFromShading.rounds; ++round) {
      better = false;
      for (std::size_t k = 0; k < best.lamps.size(); ++k) {
        Explanation other = search(best.lamps, k);
        if (!(other.cost < best.cost)) continue;
        best = std::move(other);
        better = true;
      }
    }
    return best;
  }

  /// Local search between the directions and distances of the grid.
  Explanation refine(Explanation best) {
    for (SupposedLamp& lamp : best.lamps) fit_.tabulate(lamp, kFromShading.fine_rays);
    best = with_best_powers(std::move(best), kFromShading.rough_log_steps);
    for (const float step : kFromShading.fine_steps) {
      for (std::size_t k = 0; k < best.lamps.size(); ++k) {
        bool better = true;
        for (int round = 0; better && round < kFromShading.fine_rounds; ++round) {
          better = false;
          for (const SupposedLamp& neighbour : neighbours(best.lamps[k], step)) {
            if (fit_.is_excluded(neighbour)) continue;
            Explanation other = best;
            other.lamps[k] = neighbour;
            fit_.tabulate(other.lamps[k], kFromShading.fine_rays);
            other = with_best_powers(std::move(other), kFromShading.fine_log_steps);
            if (!(other.cost < best.cost)) continue;
            best = std::move(other);
            better = true;
          }
        }
      }
    }
    return best;
  }

  static std::array<SupposedLamp, 7> neighbours(const SupposedLamp& lamp, float step) {
    std::array<SupposedLamp, 7> result;
    result.fill(lamp);
    const Vector3f x = lamp.direction.unitOrthogonal(), y = lamp.direction.cross(x);
    for (std::size_t i = 0; i < 4; ++i)
      result[i].direction = (lamp.direction + (i % 2 ? step : -step) * (i < 2 ? x : y)).normalized();
    result[4].distance_m *= std::exp(-kFromShading.fine_distance * step);
    result[5].distance_m *= std::exp(kFromShading.fine_distance * step);
    result[6].flat = !lamp.flat;
    return result;
  }

  ShadingFit& fit_;
  std::vector<SupposedLamp> grid_;
};

PointLight point_light(const SupposedLamp& found, const Array3f& unknown_radiance, const Vector3f& probe_m) {
  PointLight lamp;
  lamp.direction = found.direction;
  lamp.irradiance = found.power * unknown_radiance;
  lamp.power_log_sigma = kFromShading.power_log_sigma;
  lamp.angular_radius_rad = kFromShading.angular_radius_rad;
  lamp.distance_known = true;
  lamp.distance_log_sigma = kFromShading.distance_log_sigma;
  lamp.position_m = probe_m + found.distance_m * found.direction;
  lamp.intensity = lamp.irradiance * found.distance_m * found.distance_m;
  lamp.radius_m = found.distance_m * std::tan(lamp.angular_radius_rad);
  lamp.flat = found.flat;
  if (lamp.flat) lamp.normal = -found.direction;
  return lamp;
}

/// What a fish-eye at the probe would see of everything but lamps.
EnvironmentMap environment(const DistanceField& field, const FieldRays& rays, const Vector3f& probe_m,
                           const Array3f& unknown_radiance) {
  constexpr int kWidth = kLightParameters.environment.width, kHeight = kLightParameters.environment.height;
  EnvironmentMap map{capture::Image<float>(kWidth, kHeight, 3)};
  for (int i = 0; i < kWidth * kHeight; ++i) {
    const auto hit = rays.first_crossing(probe_m, environment_direction(i % kWidth, i / kWidth, kWidth, kHeight),
                                         kShadingParameters.max_ray_m);
    const auto radiance = hit ? field.radiance(*hit) : std::nullopt;
    Eigen::Map<Vector3f>(&map.radiance.data[3 * static_cast<std::size_t>(i)]) =
        radiance ? *radiance : Vector3f(unknown_radiance);
  }
  return map;
}

}  // namespace

LightFromShading::LightFromShading(const capture::Session& session)
    : metal_(session), print_m_(print_edge_m(session.tag)) {}

std::shared_ptr<const Illumination> LightFromShading::estimate(const DistanceField& field) {
  if (static_cast<double>(field.bricks.size()) <= kFromShading.growth * static_cast<double>(bricks_)) return last_;
  const FieldRays rays(field);
  const Vector3f probe_m = kFromShading.probe_height_m * Vector3f::UnitZ();
  ShadingFit fit(field, rays, metal_, probe_m, print_m_);
  if (fit.empty()) return last_;
  bricks_ = field.bricks.size();
  const std::vector<SupposedLamp> found = LampsFromShading(fit).find();
  fit.cost(found);
  auto light = std::make_shared<Illumination>();
  light->from_shading = true;
  light->probe_position_m = probe_m;
  light->version = last_ ? last_->version + 1 : kFirstVersion;
  for (const SupposedLamp& lamp : found) light->lights.push_back(point_light(lamp, fit.unknown_radiance(), probe_m));
  std::sort(light->lights.begin(), light->lights.end(),
            [](const PointLight& a, const PointLight& b) { return a.irradiance.sum() > b.irradiance.sum(); });
  int id = 0;
  for (PointLight& lamp : light->lights) lamp.id = --id;  // those that a fish-eye sees are not negative
  light->environment = environment(field, rays, probe_m, fit.unknown_radiance());
  light->environment_sh = project_sh(light->environment);
  last_ = std::move(light);
  return last_;
}

}  // namespace lumigraft::reconstruct
