#include "reconstruct/albedo/unobserved_occluders.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

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
/// of one of two lamps of different colours is distinguished from texture by its colour.
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

class ShadowSearch {
 public:
  ShadowSearch(const std::vector<SurfaceSample>& samples, const IrradianceModel& room,
               const std::vector<PointLight>& lights, const std::vector<SampleLight>& light,
               const std::vector<std::vector<Eigen::Vector3f>>& from_lamp, float noise_floor,
               const std::vector<SampleAlbedo>& held)
      : samples_(samples),
        from_lamp_(from_lamp),
        noise_floor_(noise_floor),
        open_(samples.size() - held.size()),
        left_(lights.size(), std::vector<float>(samples.size(), 1.0f)) {
    for (std::size_t i = 0; i < samples.size(); ++i) {
      counts_.push_back(samples[i].usable && (i < open_ || held[i - open_].sigma >= 0));
      irradiance_.push_back(light[i].irradiance);
      known_.push_back(i < open_ ? log_albedo(samples[i], light[i].irradiance, noise_floor)
                                 : held[i - open_].albedo.array().max(kUnobservedShadows.min_albedo).log().eval());
    }
    for (const PointLight& lamp : lights) may_be_occluded_.emplace_back(room, samples, lamp);
    planes_.resize(open_);
    for (std::size_t i = 0; i < open_; ++i)
      if (samples[i].usable) planes_[i] = plane_around(i, samples, counts_);
  }

  UnobservedShadows search() {
    // Albedo of samples in shadow becomes known, so that from its edge inwards all of a wide shadow is found.
    for (bool found = true; found;) {
      found = false;
      find_certain();
      for_each_undecided(
          [&](std::size_t lamp, std::size_t i, const PlaneAlbedo& plane) { found |= explains(lamp, i, plane); });
    }
    std::vector<std::vector<bool>> undecided(left_.size(), std::vector<bool>(samples_.size(), false));
    for (std::size_t lamp = 0; lamp < left_.size(); ++lamp)
      for (std::size_t i = 0; i < open_; ++i) undecided[lamp][i] = matters(lamp, i) && is_undecided(lamp, i);
    for_each_undecided([&](std::size_t lamp, std::size_t i, const PlaneAlbedo& plane) {
      undecided[lamp][i] =
          plane.sigmas(known_[i]) > kUnobservedShadows.max_unexplained * plane.sigmas(without(lamp, i, 0));
    });
    return {std::move(left_), std::move(undecided)};
  }

 private:
  /// Whether something unobserved may occlude the lamp, and nothing was found that does.
  bool is_undecided(std::size_t lamp, std::size_t i) { return left_[lamp][i] == 1 && may_be_occluded_[lamp](i); }
  bool matters(std::size_t lamp, std::size_t i) const {
    return from_lamp_[lamp][i].sum() >= kUnobservedShadows.min_lamp_fraction * irradiance_[i].sum();
  }

  /// Behind a board between two lamps each side is in the shadow of one of them: its albedo is no measure for the other
  /// side's. Without a lamp, albedo would be higher by the lamp's fraction of a channel's light.
  void find_certain() {
    certain_ = counts_;
    for (std::size_t i = 0; i < samples_.size(); ++i)
      for (std::size_t lamp = 0; lamp < left_.size() && certain_[i]; ++lamp)
        certain_[i] = (from_lamp_[lamp][i].array() <= kUnobservedShadows.model_sigma * irradiance_[i].array()).all() ||
                      !is_undecided(lamp, i);
  }

  /// `visit(lamp, sample, albedo of the certain samples of its plane)`, where there are enough.
  template <typename Visit>
  void for_each_undecided(const Visit& visit) {
    for (std::size_t i = 0; i < open_; ++i) {
      std::optional<PlaneAlbedo> plane;
      for (std::size_t lamp = 0; lamp < left_.size(); ++lamp) {
        if (planes_[i].size() < kUnobservedShadows.min_samples || !matters(lamp, i) || !is_undecided(lamp, i)) continue;
        if (!plane) plane = certain_around(i);
        if (!plane) break;
        visit(lamp, i, *plane);
      }
    }
  }

  std::optional<PlaneAlbedo> certain_around(std::size_t i) const {
    std::vector<std::size_t> members;
    for (const std::size_t j : planes_[i])
      if (certain_[j]) members.push_back(j);
    return members.size() < kUnobservedShadows.min_samples ? std::nullopt : std::optional(albedo_of(members, known_));
  }

  /// Albedo if only a fraction of the lamp arrives.
  Eigen::Array3f without(std::size_t lamp, std::size_t i, float fraction) const {
    return log_albedo(samples_[i], irradiance_[i] - (1 - fraction) * from_lamp_[lamp][i], noise_floor_);
  }

  /// Whether the shadow of a lamp explains that a sample is darker than its plane; then it is taken for found.
  bool explains(std::size_t lamp, std::size_t i, const PlaneAlbedo& plane) {
    const float difference = plane.sigmas(known_[i]);
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
    known_[i] = without(lamp, i, fraction);
    irradiance_[i] -= (1 - fraction) * from_lamp_[lamp][i];
    left_[lamp][i] = fraction;
    return true;
  }

  const std::vector<SurfaceSample>& samples_;
  const std::vector<std::vector<Eigen::Vector3f>>& from_lamp_;
  float noise_floor_;
  std::size_t open_;  ///< the first samples, which are examined
  std::vector<MayBeOccluded> may_be_occluded_;
  std::vector<std::vector<std::size_t>> planes_;
  std::vector<bool> counts_, certain_;       ///< usable and of known albedo; besides, without an undecided lamp
  std::vector<Eigen::Vector3f> irradiance_;  ///< without the lamps that are found to be occluded,
  std::vector<Eigen::Array3f> known_;        ///< and the log albedo under it
  std::vector<std::vector<float>> left_;
};

}  // namespace

UnobservedShadows unobserved_shadows(const std::vector<SurfaceSample>& samples, const IrradianceModel& room,
                                     const std::vector<PointLight>& lights, const std::vector<SampleLight>& light,
                                     const std::vector<std::vector<Eigen::Vector3f>>& from_lamp, float noise_floor,
                                     const std::vector<SampleAlbedo>& held) {
  return ShadowSearch(samples, room, lights, light, from_lamp, noise_floor, held).search();
}

}  // namespace lumigraft::reconstruct
