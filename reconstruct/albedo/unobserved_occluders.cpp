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

/// Albedo of some samples of a plane.
struct PlaneAlbedo {
  Eigen::Array3f log_albedo = Eigen::Array3f::Zero();  ///< medians
  float spread = 0;                                    ///< 1σ, from the median of differences
};

/// Samples of the same plane around one.
std::vector<std::size_t> plane_around(std::size_t own, const std::vector<SurfaceSample>& samples,
                                      const std::vector<bool>& counts) {
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
  return members;
}

PlaneAlbedo albedo_of(const std::vector<std::size_t>& members, const std::vector<Eigen::Array3f>& known) {
  PlaneAlbedo plane;
  std::vector<float> values(members.size());
  for (Eigen::Index c = 0; c < 3; ++c) {
    for (std::size_t k = 0; k < members.size(); ++k) values[k] = known[members[k]][c];
    plane.log_albedo[c] = median(values);
  }
  for (std::size_t k = 0; k < members.size(); ++k) values[k] = rms(known[members[k]] - plane.log_albedo);
  plane.spread = 1.48f * median(values);
  return plane;
}

/// Whether something unobserved may occlude a lamp from a sample; computed once.
class MayBeOccluded {
 public:
  MayBeOccluded(const IrradianceModel& room, const std::vector<SurfaceSample>& samples, const PointLight& lamp)
      : room_(room), samples_(samples), lamp_(lamp), known_(samples.size(), -1) {}
  bool operator()(std::size_t i) {
    if (known_[i] < 0) known_[i] = room_.passes_unobserved_space(lamp_, samples_[i].position, samples_[i].normal);
    return known_[i] > 0;
  }

 private:
  const IrradianceModel& room_;
  const std::vector<SurfaceSample>& samples_;
  const PointLight& lamp_;
  std::vector<signed char> known_;
};

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
  std::vector<MayBeOccluded> occluded;
  for (const PointLight& lamp : lights) occluded.emplace_back(room, samples, lamp);
  std::vector<bool> shadowed(samples.size(), false);
  std::vector<std::vector<std::size_t>> planes(open);
  std::vector<std::size_t> with_plane;
  for (std::size_t i = 0; i < open; ++i) {
    if (!samples[i].usable) continue;
    planes[i] = plane_around(i, samples, counts);
    if (planes[i].size() >= kUnobservedShadows.min_samples) with_plane.push_back(i);
  }
  std::vector<Eigen::Vector3f> irradiance;  // without the lamps that are found to be occluded
  for (std::size_t i = 0; i < open; ++i) irradiance.push_back(light[i].irradiance);
  // Whether the shadow of a lamp on an open sample explains that it is darker than the lit samples of its plane.
  const auto explains = [&](std::size_t lamp, std::size_t i) {
    if (left[lamp][i] < 1 || from_lamp[lamp][i].sum() < kUnobservedShadows.min_lamp_fraction * irradiance[i].sum() ||
        !occluded[lamp](i))
      return false;
    std::vector<std::size_t> lit;
    for (const std::size_t j : planes[i])
      if (shadowed[j] || !occluded[lamp](j)) lit.push_back(j);
    if (lit.size() < kUnobservedShadows.min_samples) return false;
    const PlaneAlbedo around = albedo_of(lit, known);
    const float difference = rms(known[i] - around.log_albedo);
    if (difference < std::max(kUnobservedShadows.min_difference, kUnobservedShadows.min_spreads * around.spread))
      return false;
    const auto without = [&](float fraction) {
      return log_albedo(samples[i], irradiance[i] - (1 - fraction) * from_lamp[lamp][i], noise_floor);
    };
    float best = difference, fraction = 1;
    for (int k = 0; k < kUnobservedShadows.steps; ++k) {
      const float tried = static_cast<float>(k) / kUnobservedShadows.steps;
      const float now = rms(without(tried) - around.log_albedo);
      if (now >= best) continue;
      best = now;
      fraction = tried;
    }
    if (best > kUnobservedShadows.max_unexplained * difference) return false;
    left[lamp][i] = fraction;
    known[i] = without(fraction);
    irradiance[i] -= (1 - fraction) * from_lamp[lamp][i];
    return true;
  };
  // Albedo of samples in shadow becomes known, so that from its edge inwards all of a wide shadow is found.
  std::vector<std::size_t> found;
  do {
    found.clear();
    for (const std::size_t i : with_plane)
      for (std::size_t lamp = 0; lamp < lights.size(); ++lamp)
        if (explains(lamp, i)) found.push_back(i);
    for (const std::size_t i : found) shadowed[i] = true;
  } while (!found.empty());
  return left;
}

}  // namespace lumigraft::reconstruct
