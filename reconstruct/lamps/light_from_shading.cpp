#include "reconstruct/lamps/light_from_shading.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "reconstruct/field/distance_field.h"
#include "reconstruct/field/field_rays.h"
#include "reconstruct/field/real_surface_mesh.h"
#include "reconstruct/lamps/lamp_posterior.h"
#include "reconstruct/lamps/parameters.h"
#include "reconstruct/lamps/sample_pairs.h"
#include "reconstruct/light/environment.h"
#include "reconstruct/light/parameters.h"
#include "reconstruct/math/median.h"
#include "reconstruct/math/tag_family.h"
#include "reconstruct/shading/irradiance.h"
#include "reconstruct/shading/noise_floor.h"
#include "reconstruct/shading/parameters.h"
#include "reconstruct/shading/surface_samples.h"
#include "reconstruct/shading/truncated_samples.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Array3f;
using Eigen::Vector3f;

struct SupposedLamp {
  Eigen::Vector3f direction = Eigen::Vector3f::UnitZ();  ///< unit, from the probe
  float distance_m = 1;
  bool flat = false;                              ///< a panel that faces the probe; else isotropic
  Eigen::Array3f power = Eigen::Array3f::Ones();  ///< irradiance at the probe over the unknown radiance
  std::vector<float> factors = {};                ///< irradiance of every sample over that at the probe: `tabulate`
};

constexpr const LampParameters::FromShading& kFromShading = kLampParameters.from_shading;

IrradianceModel::Surroundings uniform(const Vector3f& probe_m, float radiance) {
  EnvironmentMap map{capture::Image<float>(1, 1, 3)};
  std::fill(map.radiance.data.begin(), map.radiance.data.end(), radiance);
  return {probe_m, map};
}

/// How well supposed lamps explain the shading of a room that no fish-eye sees.
///
/// Irradiance of a surface: from known surface its measured radiance, from all other directions an unknown radiance,
/// the same everywhere, and the lamps. The albedo of the reference sets the unknown radiance: the tag's white paper,
/// and without it, loosely, the median over the room.
class ShadingFit {
 public:
  /// `print_m`: edge of the tag with its paper.
  ShadingFit(const DistanceField& field, const FieldRays& rays, const MetalMask& metal, const Vector3f& probe_m,
             double print_m)
      : field_(field), rays_(rays), probe_m_(probe_m), room_(field, rays, metal, nullptr, uniform(probe_m, 0)) {
    const Surface surface = find_surface(field, rays, metal, kFromShading.max_samples);
    const std::vector<bool> truncated = truncated_samples(field, surface);
    for (std::size_t i = 0; i < surface.samples.size(); ++i) {
      const SurfaceSample& sample = surface.samples[i];
      if (sample.usable && !truncated[i] && !on_tag_print(sample, print_m)) samples_.push_back(sample);
    }
    pairs_ = choose_pairs(samples_);
    if (const auto paper = tag_paper(surface.points, print_m)) {
      reference_ = {samples_.size()};
      reference_albedo_ = static_cast<float>(kLampParameters.posterior.paper_albedo);
      samples_.push_back(*paper);
    } else {
      for (std::size_t i = 0; i < samples_.size(); i += kFromShading.reference_stride) reference_.push_back(i);
      reference_albedo_ = kTypicalAlbedo;
    }
    noise_floor_ = noise_floor_radiance(samples_);
    const IrradianceModel bright(field, rays, metal, nullptr, uniform(probe_m, 1));
    for (const SurfaceSample& sample : samples_) {
      const auto gathered = [&](const IrradianceModel& room) -> Array3f {
        return room.gather(sample.position, sample.normal, kFromShading.gather_rays).irradiance.array();
      };
      log_radiance_.push_back((sample.radiance.array() + kTypicalAlbedo * noise_floor_).log());
      known_.push_back(gathered(room_));
      unknown_.push_back(gathered(bright) - known_.back());
    }
    log_albedo_.resize(samples_.size());
  }

  bool empty() const { return samples_.empty(); }  ///< no surface is known
  std::size_t pairs() const { return pairs_.size(); }

  /// Computes the lamp's factors, with `rays` over its disk.
  void tabulate(SupposedLamp& lamp, int rays) const {
    PointLight light;
    light.direction = lamp.direction;
    light.angular_radius_rad = kFromShading.angular_radius_rad;
    const Vector3f position = probe_m_ + lamp.distance_m * lamp.direction;
    lamp.factors.assign(samples_.size(), 0.0f);
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const SurfaceSample& sample = samples_[i];
      const Vector3f offset = position - sample.position, towards = offset.normalized();
      const float cosine = sample.normal.dot(towards), emission = lamp.flat ? towards.dot(lamp.direction) : 1;
      if (!(cosine > 0 && emission > 0)) continue;
      lamp.factors[i] = emission * cosine * lamp.distance_m * lamp.distance_m / offset.squaredNorm() *
                        room_.visibility(light, lamp.distance_m, sample.position, sample.normal, rays);
    }
  }
  /// Whether a lamp there would have been seen: surface is known in its direction from the probe, or it would have
  /// hidden coloured surface from a camera.
  bool is_excluded(const SupposedLamp& lamp) const {
    if (rays_.first_crossing(probe_m_, lamp.direction, kShadingParameters.max_ray_m)) return true;
    const Vector3f position = probe_m_ + lamp.distance_m * lamp.direction;
    return std::any_of(field_.seen_from_m.begin(), field_.seen_from_m.end(), [&](const Vector3f& camera_m) {
      const Vector3f offset = position - camera_m;
      const auto hit = rays_.first_crossing(camera_m, offset.normalized(), kShadingParameters.max_ray_m);
      return hit && (*hit - camera_m).norm() > offset.norm() && field_.radiance(*hit);
    });
  }

  /// Robust sum over the pairs (robust_cost), plus wide priors: a lamp is white and at a usual distance.
  double cost(std::span<const SupposedLamp> lamps) {
    scale(lamps);
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const Array3f irradiance = unknown_radiance_ * relative_irradiance(i, lamps) + known_[i];
      log_albedo_[i] = log_radiance_[i] - (irradiance * std::numbers::inv_pi_v<float> + noise_floor_).log();
    }
    double sum = robust_cost(log_albedo_, pairs_);
    for (const SupposedLamp& lamp : lamps) {
      const Array3f power = lamp.power.log();
      const float hue = (power - power.mean()).square().mean() / std::pow(kFromShading.hue_log_sigma, 2.0f);
      const float farther = std::log(lamp.distance_m / static_cast<float>(kLampParameters.usual_distance_m)) /
                            kFromShading.distance_log_sigma;
      sum += kFromShading.prior_pairs * (hue + farther * farther);
    }
    return sum;
  }
  /// Of the last call of `cost`; per channel.
  const Eigen::Array3f& unknown_radiance() const { return unknown_radiance_; }

 private:
  /// From lamps and unknown directions, over the unknown radiance.
  Array3f relative_irradiance(std::size_t sample, std::span<const SupposedLamp> lamps) const {
    Array3f sum = unknown_[sample];
    for (const SupposedLamp& lamp : lamps) sum += lamp.factors[sample] * lamp.power;
    return sum;
  }
  void scale(std::span<const SupposedLamp> lamps) {
    std::array<std::vector<float>, 3> values;
    for (const std::size_t i : reference_) {
      const Array3f irradiance =
          std::numbers::pi_v<float> / reference_albedo_ * samples_[i].radiance.array().max(noise_floor_);
      const Array3f value = (irradiance - known_[i]).max(kFromShading.min_unknown * irradiance) /
                            relative_irradiance(i, lamps).max(kFromShading.min_relative_irradiance);
      for (std::size_t c = 0; c < 3; ++c) values[c].push_back(value[static_cast<Eigen::Index>(c)]);
    }
    for (std::size_t c = 0; c < 3; ++c) unknown_radiance_[static_cast<Eigen::Index>(c)] = median(values[c]);
  }

  const DistanceField& field_;
  const FieldRays& rays_;
  Eigen::Vector3f probe_m_;
  IrradianceModel room_;
  std::vector<SurfaceSample> samples_;
  std::vector<SamplePair> pairs_;
  std::vector<std::size_t> reference_;  ///< samples that have, in the median, the albedo
  float reference_albedo_ = 0;
  float noise_floor_ = 0;                     ///< radiance
  std::vector<Eigen::Array3f> log_radiance_;  ///< of the samples
  std::vector<Eigen::Array3f> known_;         ///< irradiance from known surface
  std::vector<Eigen::Array3f> unknown_;       ///< irradiance from unknown directions, for unit radiance
  std::vector<Eigen::Array3f> log_albedo_;    ///< of the last call of `cost`
  Eigen::Array3f unknown_radiance_ = Eigen::Array3f::Zero();
};

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
