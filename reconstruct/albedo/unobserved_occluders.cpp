#include "reconstruct/albedo/unobserved_occluders.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "reconstruct/albedo/parameters.h"
#include "reconstruct/math/median.h"
#include "reconstruct/shading/noise_floor.h"

namespace lumigraft::reconstruct {
namespace {

constexpr const AlbedoParameters::Unobserved& kUnobservedShadows = kAlbedoParameters.unobserved;

Eigen::Array3f log_albedo(const SurfaceSample& sample, const Eigen::Vector3f& irradiance, float noise_floor) {
  return lambertian_albedo(sample.radiance, irradiance, noise_floor).max(kUnobservedShadows.min_albedo).log();
}

float rms(const Eigen::Array3f& a) { return std::sqrt(a.square().mean()); }

/// Albedo of some samples of a plane. Its texture differs in brightness more than in colour (wood, print): the shadow
/// of one of two lamps of different colours is told from texture by its colour.
struct PlaneAlbedo {
  Eigen::Array3f log_albedo = Eigen::Array3f::Zero();  ///< medians
  float brightness_sigma = 0, color_sigma = 0;         ///< 1σ of texture and modelled light
  /// Difference from it in σ.
  float sigmas(const Eigen::Array3f& other) const {
    const Eigen::Array3f difference = other - log_albedo;
    const float brightness = difference.mean();
    return std::hypot(brightness / brightness_sigma, rms(difference - brightness) / color_sigma);
  }
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
  std::vector<float> values(members.size()), colors(members.size());
  for (Eigen::Index c = 0; c < 3; ++c) {
    for (std::size_t k = 0; k < members.size(); ++k) values[k] = known[members[k]][c];
    plane.log_albedo[c] = median(values);
  }
  for (std::size_t k = 0; k < members.size(); ++k) {
    const Eigen::Array3f difference = known[members[k]] - plane.log_albedo;
    values[k] = std::abs(difference.mean());
    colors[k] = rms(difference - difference.mean());
  }
  constexpr float kSigmas = 1.48f;  // of a normal distribution's median deviation
  plane.brightness_sigma = std::hypot(kUnobservedShadows.model_sigma, kSigmas * median(values));
  plane.color_sigma = std::hypot(kUnobservedShadows.model_sigma, kSigmas * median(colors));
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

UnobservedShadows unobserved_shadows(const std::vector<SurfaceSample>& samples, const IrradianceModel& room,
                                     const std::vector<PointLight>& lights, const std::vector<SampleLight>& light,
                                     const std::vector<std::vector<Eigen::Vector3f>>& from_lamp, float noise_floor,
                                     const std::vector<SampleAlbedo>& held) {
  UnobservedShadows result{std::vector<std::vector<float>>(lights.size(), std::vector<float>(samples.size(), 1.0f)),
                           std::vector<std::vector<bool>>(lights.size(), std::vector<bool>(samples.size(), false))};
  std::vector<std::vector<float>>& left = result.left;
  const std::size_t open = samples.size() - held.size();
  std::vector<Eigen::Array3f> known;
  std::vector<bool> counts;
  std::vector<Eigen::Vector3f> irradiance;  // without the lamps that are found to be occluded
  for (std::size_t i = 0; i < samples.size(); ++i) {
    known.push_back(i < open ? log_albedo(samples[i], light[i].irradiance, noise_floor)
                             : Eigen::Array3f(held[i - open].albedo.array().max(kUnobservedShadows.min_albedo).log()));
    counts.push_back(samples[i].usable && (i < open || held[i - open].sigma >= 0));
    irradiance.push_back(light[i].irradiance);
  }
  std::vector<MayBeOccluded> occluded;
  for (const PointLight& lamp : lights) occluded.emplace_back(room, samples, lamp);
  std::vector<std::vector<std::size_t>> planes(open);
  std::vector<std::size_t> with_plane;
  for (std::size_t i = 0; i < open; ++i) {
    if (!samples[i].usable) continue;
    planes[i] = plane_around(i, samples, counts);
    if (planes[i].size() >= kUnobservedShadows.min_samples) with_plane.push_back(i);
  }
  // Whether something unobserved may hide the lamp, and nothing was found that does.
  const auto undecided = [&](std::size_t lamp, std::size_t i) { return left[lamp][i] == 1 && occluded[lamp](i); };
  const auto matters = [&](std::size_t lamp, std::size_t i) {
    return from_lamp[lamp][i].sum() >= kUnobservedShadows.min_lamp_fraction * irradiance[i].sum();
  };
  // Behind a board between two lamps each side is in the shadow of one of them: its albedo is no measure for the other
  // side's. Without a lamp, albedo would be higher by the lamp's fraction of the light of a channel.
  std::vector<bool> certain(samples.size());
  const auto find_certain = [&] {
    for (std::size_t i = 0; i < samples.size(); ++i) {
      certain[i] = counts[i];
      for (std::size_t lamp = 0; lamp < lights.size() && certain[i]; ++lamp)
        certain[i] = (from_lamp[lamp][i].array() <= kUnobservedShadows.model_sigma * irradiance[i].array()).all() ||
                     !undecided(lamp, i);
    }
  };
  /// Albedo of the plane around an open sample, where it is certain.
  const auto around = [&](std::size_t i) -> std::optional<PlaneAlbedo> {
    std::vector<std::size_t> members;
    for (const std::size_t j : planes[i])
      if (certain[j]) members.push_back(j);
    return members.size() < kUnobservedShadows.min_samples ? std::nullopt : std::optional(albedo_of(members, known));
  };
  const auto without = [&](std::size_t lamp, std::size_t i, float fraction) {
    return log_albedo(samples[i], irradiance[i] - (1 - fraction) * from_lamp[lamp][i], noise_floor);
  };
  // Whether the shadow of a lamp on an open sample explains that it is darker than its plane.
  const auto explains = [&](std::size_t lamp, std::size_t i, const PlaneAlbedo& plane) {
    const float difference = plane.sigmas(known[i]);
    if (difference < kUnobservedShadows.min_sigmas) return false;
    float best = difference, fraction = 1;
    for (int k = 0; k < kUnobservedShadows.steps; ++k) {
      const float tried = static_cast<float>(k) / kUnobservedShadows.steps;
      const float now = plane.sigmas(without(lamp, i, tried));
      if (now >= best) continue;
      best = now;
      fraction = tried;
    }
    if (best > kUnobservedShadows.max_unexplained * difference) return false;
    known[i] = without(lamp, i, fraction);
    irradiance[i] -= (1 - fraction) * from_lamp[lamp][i];
    left[lamp][i] = fraction;
    return true;
  };
  // Albedo of samples in shadow becomes known, so that from its edge inwards all of a wide shadow is found.
  bool found = true;
  while (found) {
    found = false;
    find_certain();
    for (const std::size_t i : with_plane) {
      const std::optional<PlaneAlbedo> plane = around(i);
      for (std::size_t lamp = 0; plane && lamp < lights.size(); ++lamp)
        found |= matters(lamp, i) && undecided(lamp, i) && explains(lamp, i, *plane);
    }
  }
  for (std::size_t i = 0; i < open; ++i) {
    const std::optional<PlaneAlbedo> plane = around(i);
    for (std::size_t lamp = 0; lamp < lights.size(); ++lamp)
      result.undecided[lamp][i] = matters(lamp, i) && undecided(lamp, i) &&
                                  !(plane && plane->sigmas(known[i]) <= kUnobservedShadows.max_unexplained *
                                                                            plane->sigmas(without(lamp, i, 0)));
  }
  return result;
}

}  // namespace lumigraft::reconstruct
