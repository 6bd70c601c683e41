#include "reconstruct/albedo/unobserved_occluders.h"

#include <algorithm>
#include <cmath>

#include "reconstruct/albedo/parameters.h"
#include "reconstruct/math/median.h"
#include "reconstruct/shading/noise_floor.h"

namespace lumigraft::reconstruct {
namespace {

constexpr const AlbedoParameters::UnobservedShadows& kUnobservedShadows = kAlbedoParameters.unobserved;

Eigen::Array3f log_albedo(const SurfaceSample& sample, const Eigen::Vector3f& irradiance, float noise_floor) {
  return lambertian_albedo(sample.radiance, irradiance, noise_floor).max(kUnobservedShadows.min_albedo).log();
}

float rms(const Eigen::Array3f& a) { return std::sqrt(a.square().mean()); }

/// Albedo of the plane around a sample.
struct PlaneAlbedo {
  Eigen::Array3f log_albedo = Eigen::Array3f::Zero();  ///< medians
  float spread = 0;                                    ///< 1σ, from the median of differences
  std::size_t count = 0;
};

PlaneAlbedo albedo_around(std::size_t own, const std::vector<SurfaceSample>& samples,
                          const std::vector<Eigen::Array3f>& known, const std::vector<bool>& counts) {
  const SurfaceSample& sample = samples[own];
  std::vector<std::size_t> members;
  for (std::size_t j = 0; j < samples.size(); ++j) {
    if (j == own || !counts[j]) continue;
    const Eigen::Vector3f offset = samples[j].position - sample.position;
    if (offset.squaredNorm() > kUnobservedShadows.reach_m * kUnobservedShadows.reach_m ||
        std::abs(sample.normal.dot(offset)) > kUnobservedShadows.plane_m ||
        sample.normal.dot(samples[j].normal) < kUnobservedShadows.same_normal)
      continue;
    members.push_back(j);
  }
  PlaneAlbedo around;
  around.count = members.size();
  if (members.size() < kUnobservedShadows.min_samples) return around;
  std::vector<float> values(members.size());
  for (Eigen::Index c = 0; c < 3; ++c) {
    for (std::size_t k = 0; k < members.size(); ++k) values[k] = known[members[k]][c];
    around.log_albedo[c] = median(values);
  }
  for (std::size_t k = 0; k < members.size(); ++k) values[k] = rms(known[members[k]] - around.log_albedo);
  around.spread = 1.48f * median(values);
  return around;
}

}  // namespace

std::vector<std::vector<float>> unobserved_shadows(const std::vector<SurfaceSample>& samples,
                                                   const IrradianceModel& room, const std::vector<PointLight>& lights,
                                                   const std::vector<SampleLight>& light,
                                                   const std::vector<std::vector<Eigen::Vector3f>>& from_lamp,
                                                   float noise_floor, const std::vector<SampleAlbedo>& held) {
  std::vector<std::vector<float>> left(lights.size(), std::vector<float>(samples.size(), 1.0f));
  const std::size_t open = samples.size() - held.size();
  std::vector<Eigen::Array3f> known;
  std::vector<bool> counts;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    known.push_back(i < open ? log_albedo(samples[i], light[i].irradiance, noise_floor)
                             : Eigen::Array3f(held[i - open].albedo.array().max(kUnobservedShadows.min_albedo).log()));
    counts.push_back(samples[i].usable && (i < open || held[i - open].sigma >= 0));
  }
  for (std::size_t i = 0; i < open; ++i) {
    if (!samples[i].usable) continue;
    const PlaneAlbedo around = albedo_around(i, samples, known, counts);
    if (around.count < kUnobservedShadows.min_samples) continue;
    Eigen::Vector3f irradiance = light[i].irradiance;
    float difference = rms(known[i] - around.log_albedo);
    for (std::size_t lamp = 0; lamp < lights.size(); ++lamp) {
      if (difference < std::max(kUnobservedShadows.min_difference, kUnobservedShadows.min_spreads * around.spread))
        break;
      if (from_lamp[lamp][i].sum() < kUnobservedShadows.min_lamp_fraction * irradiance.sum()) continue;
      float best = difference, fraction = 1;
      for (int k = 0; k < kUnobservedShadows.steps; ++k) {
        const float tried = static_cast<float>(k) / kUnobservedShadows.steps;
        const float now =
            rms(log_albedo(samples[i], irradiance - (1 - tried) * from_lamp[lamp][i], noise_floor) - around.log_albedo);
        if (now >= best) continue;
        best = now;
        fraction = tried;
      }
      if (best > kUnobservedShadows.max_unexplained * difference ||
          !room.passes_unobserved_space(lights[lamp], samples[i].position, samples[i].normal))
        continue;
      left[lamp][i] = fraction;
      irradiance -= (1 - fraction) * from_lamp[lamp][i];
      difference = best;
    }
  }
  return left;
}

}  // namespace lumigraft::reconstruct
