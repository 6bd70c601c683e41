#include "reconstruct/lamps/shading_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "reconstruct/lamps/lamp_refinement.h"
#include "reconstruct/lamps/parameters.h"
#include "reconstruct/math/median.h"
#include "reconstruct/shading/noise_floor.h"
#include "reconstruct/shading/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Array3f;
using Eigen::Vector3f;

constexpr const LampParameters::FromShading& kFromShading = kLampParameters.from_shading;

IrradianceModel::Surroundings uniform(const Vector3f& probe_m, float radiance) {
  EnvironmentMap map{capture::Image<float>(1, 1, 3)};
  std::fill(map.radiance.data.begin(), map.radiance.data.end(), radiance);
  return {probe_m, map};
}

}  // namespace

ShadingFit::ShadingFit(const DistanceField& field, const FieldRays& rays, const MetalMask& metal,
                       const Vector3f& probe_m, double print_m)
    : field_(field), rays_(rays), probe_m_(probe_m), room_(field, rays, metal, nullptr, uniform(probe_m, 0)) {
  const Surface surface = find_surface(field, rays, metal, kFromShading.max_samples);
  for (const SurfaceSample& sample : surface.samples)
    if (sample.usable && !on_tag_print(sample, print_m)) samples_.push_back(sample);
  pairs_ = choose_pairs(samples_);
  if (const auto paper = tag_paper(surface.points, print_m)) {
    reference_ = {samples_.size()};
    reference_albedo_ = static_cast<float>(kLampParameters.refinement.paper_albedo);
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

void ShadingFit::tabulate(SupposedLamp& lamp, int rays) const {
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

bool ShadingFit::is_excluded(const SupposedLamp& lamp) const {
  if (rays_.first_crossing(probe_m_, lamp.direction, kShadingParameters.max_ray_m)) return true;
  const Vector3f position = probe_m_ + lamp.distance_m * lamp.direction;
  return std::any_of(field_.seen_from_m.begin(), field_.seen_from_m.end(), [&](const Vector3f& camera_m) {
    const Vector3f offset = position - camera_m;
    const auto hit = rays_.first_crossing(camera_m, offset.normalized(), kShadingParameters.max_ray_m);
    return hit && (*hit - camera_m).norm() > offset.norm() && field_.radiance(*hit);
  });
}

/// From lamps and unknown directions, over the unknown radiance.
Array3f ShadingFit::relative_irradiance(std::size_t sample, std::span<const SupposedLamp> lamps) const {
  Array3f sum = unknown_[sample];
  for (const SupposedLamp& lamp : lamps) sum += lamp.factors[sample] * lamp.power;
  return sum;
}

void ShadingFit::scale(std::span<const SupposedLamp> lamps) {
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

double ShadingFit::cost(std::span<const SupposedLamp> lamps) {
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

}  // namespace lumigraft::reconstruct
