#include "reconstruct/albedo/surface_points.h"

#include <algorithm>
#include <cmath>

#include "reconstruct/albedo/unobserved_occluders.h"
#include "reconstruct/shading/noise_floor.h"

namespace lumigraft::reconstruct {
namespace {

constexpr int kSampleRays = 8, kPointRays = 4;
constexpr float kModelShare = 0.08f;     ///< 1σ of modelled irradiance over itself, away from shadows,
constexpr float kPointShare = 0.01f;     ///< and of how much of that differs from point to point
constexpr float kLampsShare = 0.02f;     ///< 1σ of the lamps' light over itself that is wrong for a whole surface, but
                                         ///< for their distance,
constexpr float kGatheredShare = 0.08f;  ///< of the other light, of which more is guessed,
constexpr float kTextureShare = 2.5f;    ///< and of how much a patch's radiance varies: so does a voxel's
constexpr float kEdgeShare = 0.35f;      ///< of a lamp's light where visibility varies around a sample
constexpr float kSteepest = 4;           ///< of the lamps' light with their distance: beyond it a surface is grazed
constexpr float kMetalSigma = 0.02f;     ///< said by an operator

/// ∂ log E / ∂ log d of a lamp's irradiance at a place, d its distance from the probe, where its power was measured.
float distance_slope(const PointLight& light, const Eigen::Vector3f& probe, const Eigen::Vector3f& position,
                     const Eigen::Vector3f& normal) {
  const Eigen::Vector3f way = light.position_m - position, step = light.position_m - probe;
  const float squared = way.squaredNorm(), facing = normal.dot(way);
  if (!(facing > 0)) return 0;
  float slope = 2 + normal.dot(step) / facing - 3 * step.dot(way) / squared;
  if (light.flat && light.normal.dot(way) < 0) {
    slope += light.normal.dot(step) / light.normal.dot(way) - step.dot(way) / squared;
  }
  return std::clamp(slope, -kSteepest, kSteepest);
}

}  // namespace

LitSurface::LitSurface(const Surface& surface, const IrradianceModel& room, const Illumination& illumination,
                       const std::vector<Eigen::Vector3f>& gathered, float dark, const std::vector<SampleAlbedo>& held)
    : surface_(surface),
      room_(room),
      illumination_(illumination),
      gathered_(gathered),
      dark_(dark),
      neighbours_(lumigraft::reconstruct::neighbours(surface.samples, kNeighbourReach)) {
  const std::vector<SurfaceSample>& samples = surface.samples;
  for (std::size_t i = 0; i < samples.size(); ++i) sample_light_.push_back({gathered[i], 0});
  std::vector<Eigen::Vector3f> doubt(samples.size(), Eigen::Vector3f::Zero());
  std::vector<std::vector<Eigen::Vector3f>> from_lamp;
  for (std::size_t lamp = 0; lamp < illumination.lights.size(); ++lamp) {
    const PointLight& light = illumination.lights[lamp];
    std::vector<float> visible(samples.size());
    std::vector<Eigen::Vector3f> irradiance(samples.size());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const float distance =
          light.distance_known ? (light.position_m - illumination.probe_position_m).norm() : kInfinitelyFar;
      visible[i] = room.visibility(light, distance, samples[i].position, samples[i].normal, kSampleRays);
      irradiance[i] = lamp_irradiance(lamp, samples[i].position, samples[i].normal, visible[i]);
      sample_light_[i].irradiance += irradiance[i];
    }
    visible_.push_back(std::move(visible));
    from_lamp.push_back(std::move(irradiance));
  }
  left_ = hidden_shadows(samples, room, illumination.lights, sample_light_, from_lamp, dark, held);
  for (std::size_t lamp = 0; lamp < illumination.lights.size(); ++lamp) {
    std::vector<float>& visible = visible_[lamp];
    std::vector<float> contrast(samples.size(), 0.0f);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      visible[i] *= left_[lamp][i];
      sample_light_[i].irradiance -= (1 - left_[lamp][i]) * from_lamp[lamp][i];
    }
    for (std::size_t i = 0; i < samples.size(); ++i) {
      contrast[i] = std::min(visible[i], 1 - visible[i]);
      for (const int j : neighbours_[i]) {
        contrast[i] = std::max(contrast[i], std::abs(visible[i] - visible[static_cast<std::size_t>(j)]));
      }
      doubt[i] += kEdgeShare * contrast[i] * lamp_irradiance(lamp, samples[i].position, samples[i].normal, 1);
    }
    contrast_.push_back(std::move(contrast));
  }
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const float edge = doubt[i].mean() / std::max(sample_light_[i].irradiance.mean(), 1e-9f);
    sample_light_[i].sigma_share = std::hypot(kModelShare, edge);
  }
}

Eigen::Vector3f LitSurface::lamp_irradiance(std::size_t lamp, const Eigen::Vector3f& position,
                                            const Eigen::Vector3f& normal, float visible) const {
  const PointLight& light = illumination_.lights[lamp];
  if (!light.distance_known) return visible * std::max(0.0f, normal.dot(light.direction)) * light.irradiance;
  const Eigen::Vector3f way = light.position_m - position;
  const float squared = way.squaredNorm(), length = std::sqrt(squared);
  return visible * light.emission(-way / length) * std::max(0.0f, normal.dot(way) / length) / squared * light.intensity;
}

float LitSurface::visibility(std::size_t lamp, const SurfacePoint& point) const {
  const auto sample = static_cast<std::size_t>(point.sample);
  if (contrast_[lamp][sample] == 0) return visible_[lamp][sample];
  const PointLight& light = illumination_.lights[lamp];
  const float distance =
      light.distance_known ? (light.position_m - illumination_.probe_position_m).norm() : kInfinitelyFar;
  return left_[lamp][sample] * room_.visibility(light, distance, point.position, point.normal, kPointRays);
}

std::vector<PointAlbedo> LitSurface::albedo(const std::vector<SampleAlbedo>& samples) const {
  std::vector<PointAlbedo> result(surface_.points.size());
  // The pieces of one lamp are wrong together: its power was found for all of them.
  const std::vector<PointLight>& lights = illumination_.lights;
  std::vector<std::size_t> first_piece(lights.size());
  std::vector<float> region_doubt(lights.size()), region_place(lights.size());
  for (std::size_t lamp = 0; lamp < lights.size(); ++lamp) {
    std::size_t first = lamp;
    for (std::size_t other = lamp; other-- > 0;)
      if (lights[lamp].region >= 0 && lights[other].region == lights[lamp].region) first = other;
    first_piece[lamp] = first;
  }
  for (std::size_t i = 0; i < surface_.points.size(); ++i) {
    const SurfacePoint& point = surface_.points[i];
    if (point.metal) {
      result[i].sigma = kMetalSigma;
      continue;
    }
    const auto own = static_cast<std::size_t>(point.sample);
    Eigen::Vector3f gathered = Eigen::Vector3f::Zero(), around = Eigen::Vector3f::Zero();
    float weights = 0, known_weights = 0, sigma = 0, spread = 0, texture = 0;
    const auto add = [&](std::size_t j) {
      const SurfaceSample& sample = surface_.samples[j];
      const float facing = std::max(0.0f, point.normal.dot(sample.normal));
      const float squared = (point.position - sample.position).squaredNorm() / (sample.size_m * sample.size_m);
      const float w = facing * facing * facing * facing / (0.05f + squared) + 1e-6f;
      gathered += w * gathered_[j];
      weights += w;
      if (samples[j].sigma < 0) return;
      around += w * samples[j].albedo;
      sigma += w * samples[j].sigma;
      spread += w * sample.spread;
      texture += w * sample.texture;
      known_weights += w;
    };
    add(own);
    for (const int j : neighbours_[own]) add(static_cast<std::size_t>(j));

    Eigen::Vector3f irradiance = gathered / weights;
    const float gathered_mean = irradiance.mean();
    float doubt = 0;
    std::fill(region_doubt.begin(), region_doubt.end(), 0.0f);
    std::fill(region_place.begin(), region_place.end(), 0.0f);
    for (std::size_t lamp = 0; lamp < illumination_.lights.size(); ++lamp) {
      const Eigen::Vector3f from_lamp = lamp_irradiance(lamp, point.position, point.normal, visibility(lamp, point));
      irradiance += from_lamp;
      const PointLight& light = lights[lamp];
      region_doubt[first_piece[lamp]] += light.power_log_sigma * from_lamp.mean();
      if (light.distance_known) {
        region_place[first_piece[lamp]] +=
            light.distance_log_sigma * from_lamp.mean() *
            distance_slope(light, illumination_.probe_position_m, point.position, point.normal);
      }
      doubt += kEdgeShare * contrast_[lamp][own] * lamp_irradiance(lamp, point.position, point.normal, 1).mean();
    }
    float lamp_doubt = 0;
    for (std::size_t lamp = 0; lamp < lights.size(); ++lamp)
      lamp_doubt = std::hypot(lamp_doubt, region_doubt[lamp], region_place[lamp]);
    const Eigen::Array3f direct = matt_albedo(point.radiance, irradiance, dark_).min(1.0f);
    const float share = std::hypot(kPointShare, doubt / std::max(irradiance.mean(), 1e-9f));
    const float direct_sigma =
        std::hypot(share * direct.mean(), dark_sigma(dark_) / std::max(irradiance.mean(), 1e-9f));
    if (!(known_weights > 0)) continue;
    around /= known_weights;
    // A texture makes its surroundings say less about a point.
    const float around_sigma = std::hypot(sigma / known_weights, spread / known_weights * around.mean());
    const float w_direct = 1 / (direct_sigma * direct_sigma + 1e-8f);
    const float w_around = 1 / (around_sigma * around_sigma + 1e-8f);
    result[i].albedo = ((w_direct * direct + w_around * around.array()) / (w_direct + w_around)).matrix();
    // What the model has wrong, and a lamp's power and place, it has wrong for the surroundings too: they are no better
    // for it.
    // Texture that a patch shows goes on within voxels.
    const float whole = std::max(irradiance.mean(), 1e-9f);
    const float by_model = std::hypot(kLampsShare * (whole - gathered_mean), kGatheredShare * gathered_mean) / whole;
    const float common = std::hypot(by_model, lamp_doubt / whole, kTextureShare * texture / known_weights);
    result[i].sigma = std::hypot(1 / std::sqrt(w_direct + w_around), common * result[i].albedo.mean());
  }
  return result;
}

}  // namespace lumigraft::reconstruct
