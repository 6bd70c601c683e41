#include "reconstruct/fusion_brick.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace lumigraft {
namespace {

using Voxels = Eigen::Array<float, kBrickVoxels, 1>;

constexpr float kNearShare = 0.02f, kAwayShare = 0.1f;  // of a voxel
constexpr float kNearVoxels = 2;
constexpr float kSigmaM = 0.0012f;  // of a measurement of weight 1
constexpr float kNoiseShare = 0.5f;
constexpr float kRadianceShare = 0.01f;
constexpr float kPlain = 8 * 8;  // squared, over the mean square

Eigen::Map<const Voxels> over(const std::array<float, kBrickVoxels>& values) {
  return Eigen::Map<const Voxels>(values.data());
}

}  // namespace

WorkingBrick::Drift WorkingBrick::drift(float voxel_m) const {
  if (!published) return looks > 0 ? Drift::plain : Drift::none;
  const FieldBrick& old = *published;
  if (((over(now.weight) > 0) != (over(old.weight) > 0)).any()) return Drift::plain;
  const float near = kNearShare * voxel_m, away = kAwayShare * voxel_m, reach = kNearVoxels * voxel_m;
  const Voxels seen = (over(now.distance_m).abs() < reach).select(Voxels::Constant(near * near), away * away);
  const Voxels noise = kNoiseShare * kNoiseShare * kSigmaM * kSigmaM / (over(now.weight) + 1e-6f);
  const Voxels ratio = (over(now.distance_m) - over(old.distance_m)).square() / seen.max(noise);
  if (ratio.maxCoeff() > kPlain) return Drift::plain;
  if (ratio.mean() > 1) return Drift::slight;

  const auto coloured = (over(now.radiance_weight) > 0).count();
  if (coloured == 0) return Drift::none;
  if (((over(now.radiance_weight) > 0) != (over(old.radiance_weight) > 0)).any()) return Drift::plain;
  // Dark voxels count by the brick's mean: nobody sees 1 % of black.
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (const Eigen::Vector3f& radiance : old.radiance) sum += radiance;
  const float mean = sum.sum() / static_cast<float>(coloured);
  float total = 0;
  for (std::size_t i = 0; i < kBrickVoxels; ++i) {
    const float scale = kRadianceShare * std::max(old.radiance[i].sum(), mean) + 1e-9f;
    const float share = (now.radiance[i] - old.radiance[i]).squaredNorm() * 3 / (scale * scale);
    if (share > kPlain) return Drift::plain;
    total += share;
  }
  return total > static_cast<float>(coloured) ? Drift::slight : Drift::none;
}

}  // namespace lumigraft
