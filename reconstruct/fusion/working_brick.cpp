#include "reconstruct/fusion/working_brick.h"

#include <sys/mman.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <new>

#include "reconstruct/fusion/depth_noise.h"
#include "reconstruct/math/simd4.h"

namespace lumigraft::reconstruct {
namespace {

constexpr float kNoise = static_cast<float>(0.5 * kLeastSigmaM);  // of a measurement of weight 1
constexpr std::size_t kAtOnce = 64;                               // voxels

}  // namespace

bool WorkingBrick::drifted(const FieldBrick& next, float voxel_m) {
  drift = kDriftUnknown;
  if (!published) return true;
  const FieldBrick& old = *published;
  const float near = kDriftNearShare * voxel_m, away = kDriftAwayShare * voxel_m;
  const Simd4 near_square = all(near * near), away_square = all(away * away), reach = all(kDriftNearVoxels * voxel_m);
  const Simd4 noise_square = all(kNoise * kNoise);
  const Simd4 surely_away = all((kDriftNearVoxels + kDriftMargin) * voxel_m);
  Simd4Int learnt{};
  Simd4 sum{}, most_sum{};
  for (std::size_t i = 0; i < kBrickVoxels; i += 4) {
    const Simd4 w = load(&next.weight[i]), d = load(&next.distance_m[i]), off = d - load(&old.distance_m[i]);
    learnt |= (w > 0) ^ (load(&old.weight[i]) > 0);
    sum += off * off / max(select(size_of(d) < reach, near_square, away_square), noise_square / (w + 1e-6f));
    // Noise forgives less as a voxel is known better, and one may come near.
    most_sum += off * off / select(size_of(d) < surely_away, near_square, away_square);
    // What has drifted far is known early.
    if (i % kAtOnce == kAtOnce - 4 && (any(learnt) || sum_of(sum) > kBrickVoxels)) return true;
  }

  // Dark voxels count by the brick's mean: nobody sees 1 % of black.
  float light = 0;
  int coloured = 0;
  for (std::size_t i = 0; i < kBrickVoxels; ++i) {
    if (!(next.radiance_weight[i] > 0)) continue;
    if (!(old.radiance_weight[i] > 0)) return true;
    ++coloured;
    light += old.radiance[i].sum();
  }
  float total = 0;
  if (coloured > 0) {
    const float mean = light / static_cast<float>(coloured);
    for (std::size_t i = 0; i < kBrickVoxels; ++i) {
      if (!(next.radiance_weight[i] > 0)) continue;
      const float scale = kDriftRadianceShare * std::max(old.radiance[i].sum(), mean) + 1e-9f;
      total += (next.radiance[i] - old.radiance[i]).squaredNorm() * 3 / (scale * scale);
    }
    if (total > static_cast<float>(coloured)) return true;
    // A voxel's own scale is no less than that of the mean.
    most_radiance_drift = (kDriftRadianceShare * mean + 1e-9f) * std::sqrt(static_cast<float>(coloured) / 3);
    radiance_drift = most_radiance_drift * std::sqrt(total / static_cast<float>(coloured));
  } else {
    radiance_drift = 0;
    most_radiance_drift = kDriftUnknown;
  }
  drift = std::sqrt(sum_of(most_sum) / kBrickVoxels);
  return false;
}

WorkingBrick& WorkingBricks::add() {
  if (size_ == chunks_.size() * kInChunk) {
    void* chunk = std::aligned_alloc(kChunk_bytes, kChunk_bytes);
    if (!chunk) throw std::bad_alloc();
    chunks_.emplace_back(static_cast<WorkingBrick*>(chunk));
    ::madvise(chunk, kChunk_bytes, MADV_HUGEPAGE);  // a wish: where it is not granted all works as before
  }
  return *new (&(*this)[size_++]) WorkingBrick();
}

void WorkingBricks::clear() {
  for (; size_ > 0; --size_) std::destroy_at(&(*this)[size_ - 1]);
  chunks_.clear();
}

}  // namespace lumigraft::reconstruct
