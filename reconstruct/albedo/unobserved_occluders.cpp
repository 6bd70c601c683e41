#include "reconstruct/albedo/unobserved_occluders.h"

#include <algorithm>
#include <cmath>

#include "reconstruct/math/median.h"
#include "reconstruct/shading/noise_floor.h"

namespace lumigraft::reconstruct {
namespace {

constexpr float kAround_m = 0.5f, kPlane_m = 0.03f, kSameSide = 0.95f;  ///< the last a cosine
constexpr std::size_t kFewest = 12;                                     ///< samples that tell what a surface is like
constexpr float kDarker = 0.15f;      ///< of log albedo: less is the model's own error;
constexpr float kSpreads = 2.5f;      ///< of the surface's own texture, as many
constexpr float kExplained = 0.5f;    ///< of the difference that may be left
constexpr float kLeastShare = 0.15f;  ///< of a sample's light that a lamp sends
constexpr int kSteps = 8;             ///< shares of a lamp
constexpr float kLeast = 0.02f;       ///< of albedo

Eigen::Array3f log_albedo(const SurfaceSample& sample, const Eigen::Vector3f& irradiance, float dark) {
  return matt_albedo(sample.radiance, irradiance, dark).max(kLeast).log();
}

float rms(const Eigen::Array3f& a) { return std::sqrt(a.square().mean()); }

/// What a surface is like around a sample.
struct Around {
  Eigen::Array3f log_albedo = Eigen::Array3f::Zero();  ///< medians
  float spread = 0;                                    ///< 1σ, from the median of differences
  std::size_t count = 0;
};

Around look_around(std::size_t own, const std::vector<SurfaceSample>& samples, const std::vector<Eigen::Array3f>& known,
                   const std::vector<bool>& counts) {
  const SurfaceSample& sample = samples[own];
  std::vector<std::size_t> places;
  for (std::size_t j = 0; j < samples.size(); ++j) {
    if (j == own || !counts[j]) continue;
    const Eigen::Vector3f way = samples[j].position - sample.position;
    if (way.squaredNorm() > kAround_m * kAround_m || std::abs(sample.normal.dot(way)) > kPlane_m ||
        sample.normal.dot(samples[j].normal) < kSameSide)
      continue;
    places.push_back(j);
  }
  Around around;
  around.count = places.size();
  if (places.size() < kFewest) return around;
  std::vector<float> values(places.size());
  for (Eigen::Index c = 0; c < 3; ++c) {
    for (std::size_t k = 0; k < places.size(); ++k) values[k] = known[places[k]][c];
    around.log_albedo[c] = median(values);
  }
  for (std::size_t k = 0; k < places.size(); ++k) values[k] = rms(known[places[k]] - around.log_albedo);
  around.spread = 1.48f * median(values);
  return around;
}

}  // namespace

std::vector<std::vector<float>> hidden_shadows(const std::vector<SurfaceSample>& samples, const IrradianceModel& room,
                                               const std::vector<PointLight>& lights,
                                               const std::vector<SampleLight>& light,
                                               const std::vector<std::vector<Eigen::Vector3f>>& from_lamp, float dark,
                                               const std::vector<SampleAlbedo>& held) {
  std::vector<std::vector<float>> left(lights.size(), std::vector<float>(samples.size(), 1.0f));
  const std::size_t open = samples.size() - held.size();
  std::vector<Eigen::Array3f> known;
  std::vector<bool> counts;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    known.push_back(i < open ? log_albedo(samples[i], light[i].irradiance, dark)
                             : Eigen::Array3f(held[i - open].albedo.array().max(kLeast).log()));
    counts.push_back(samples[i].usable && (i < open || held[i - open].sigma >= 0));
  }
  for (std::size_t i = 0; i < open; ++i) {
    if (!samples[i].usable) continue;
    const Around around = look_around(i, samples, known, counts);
    if (around.count < kFewest) continue;
    Eigen::Vector3f irradiance = light[i].irradiance;
    float off = rms(known[i] - around.log_albedo);
    for (std::size_t lamp = 0; lamp < lights.size(); ++lamp) {
      if (off < std::max(kDarker, kSpreads * around.spread)) break;
      if (from_lamp[lamp][i].sum() < kLeastShare * irradiance.sum()) continue;
      float best = off, share = 1;
      for (int k = 0; k < kSteps; ++k) {
        const float here = static_cast<float>(k) / kSteps;
        const float now =
            rms(log_albedo(samples[i], irradiance - (1 - here) * from_lamp[lamp][i], dark) - around.log_albedo);
        if (now >= best) continue;
        best = now;
        share = here;
      }
      if (best > kExplained * off || !room.hidden_way(lights[lamp], samples[i].position, samples[i].normal)) continue;
      left[lamp][i] = share;
      irradiance -= (1 - share) * from_lamp[lamp][i];
      off = best;
    }
  }
  return left;
}

}  // namespace lumigraft::reconstruct
