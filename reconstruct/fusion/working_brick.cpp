#include "reconstruct/fusion/working_brick.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "reconstruct/fusion/parameters.h"
#include "reconstruct/math/depth_noise.h"
#include "reconstruct/math/simd4.h"

namespace lumigraft::reconstruct {
namespace {

constexpr float kNoise_m = static_cast<float>(kPublication.noise * kMinDepthSigma_m);  // of a measurement of weight 1
constexpr std::size_t kCheckVoxels = 64;  // between checks for an early result

}  // namespace

bool WorkingBrick::drifted(const FieldBrick& next, float voxel_m) {
  drift = kDriftUnknown;
  if (!published) return true;
  const FieldBrick& old = *published;
  const float near = kPublication.drift_near_voxels * voxel_m, away = kPublication.drift_away_voxels * voxel_m;
  const Simd4 near_square = broadcast(near * near), away_square = broadcast(away * away),
              reach = broadcast(kPublication.near_voxels * voxel_m);
  const Simd4 noise_square = broadcast(kNoise_m * kNoise_m);
  const Simd4 surely_away = broadcast((kPublication.near_voxels + kPublication.near_margin_voxels) * voxel_m);
  Simd4Int became_known{};
  Simd4 sum{}, max_sum{};
  for (std::size_t i = 0; i < kBrickVoxels; i += 4) {
    const Simd4 w = load(&next.weight[i]), d = load(&next.distance_m[i]), difference = d - load(&old.distance_m[i]);
    became_known |= (w > 0) ^ (load(&old.weight[i]) > 0);
    sum += difference * difference / max(select(abs(d) < reach, near_square, away_square), noise_square / (w + 1e-6f));
    // The upper bound ignores noise, which shrinks as the weight grows, and allows for voxels that come near.
    max_sum += difference * difference / select(abs(d) < surely_away, near_square, away_square);
    // Early result for a large drift.
    if (i % kCheckVoxels == kCheckVoxels - 4 && (any(became_known) || sum_of(sum) > kBrickVoxels)) return true;
  }

  // Few voxels have colour.
  std::array<std::uint16_t, kBrickVoxels> with_color{};
  std::size_t colored = 0;
  for (std::size_t i = 0; next.color && i < kBrickVoxels; i += 4) {
    const Simd4 weights = load(&next.color->weight[i]);
    // Of a lower bound, which channels it is of.
    const Simd4 before = old.color ? load(&old.color->weight[i]) : Simd4{};
    if (any((weights < 0) & (weights != before))) return true;
    if (!any(weights > 0)) continue;
    for (std::size_t k = i; k < i + 4; ++k) {
      with_color[colored] = static_cast<std::uint16_t>(k);
      colored += next.color->weight[k] > 0 ? 1 : 0;
    }
  }
  // Dark voxels are compared relative to the brick's mean: 1 % of black is invisible.
  float radiance_sum = 0;
  for (std::size_t k = 0; k < colored; ++k) {
    if (!(old.radiance_weight(with_color[k]) > 0)) return true;
    radiance_sum += old.color->radiance[with_color[k]].sum();
  }
  float total = 0;
  if (colored > 0) {
    const float mean = radiance_sum / static_cast<float>(colored);
    for (std::size_t k = 0; k < colored; ++k) {
      const Eigen::Vector3f& was = old.color->radiance[with_color[k]];
      const float scale = kPublication.drift_radiance * std::max(was.sum(), mean) + 1e-9f;
      total += (next.color->radiance[with_color[k]] - was).squaredNorm() * 3 / (scale * scale);
    }
    if (total > static_cast<float>(colored)) return true;
    // Lower bound of the allowed drift: no voxel's scale is below that of the mean.
    max_radiance_drift = (kPublication.drift_radiance * mean + 1e-9f) * std::sqrt(static_cast<float>(colored) / 3);
    radiance_drift = max_radiance_drift * std::sqrt(total / static_cast<float>(colored));
  } else {
    radiance_drift = 0;
    max_radiance_drift = kDriftUnknown;
  }
  drift = std::sqrt(sum_of(max_sum) / kBrickVoxels);
  return false;
}

bool WorkingBrick::has_color() const {
  return now && now->color &&
         std::any_of(now->color->weight.begin(), now->color->weight.end(), [](float w) { return w > 0; });
}

WorkingBrick& WorkingBricks::at(const BrickKey& key) {
  const auto [entry, is_new] = by_key_.try_emplace(key);
  if (is_new) {
    entry->second = bricks_.emplace_back(std::make_unique<WorkingBrick>()).get();
    entry->second->key = key;
    entry->second->turn = created_++;
  }
  return *entry->second;
}

}  // namespace lumigraft::reconstruct
