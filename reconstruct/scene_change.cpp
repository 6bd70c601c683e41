#include "reconstruct/scene_change.h"

#include <algorithm>

namespace lumigraft::reconstruct {

using Eigen::Vector3f;

float moved_fraction(const DistanceField& now, const DistanceField& before) {
  if (now.bricks.empty()) return 0;
  const auto mean = [](const FieldBrick& brick) {
    Vector3f sum = Vector3f::Zero();
    float weights = 0;
    for (std::size_t i = 0; i < brick.radiance.size(); ++i) {
      sum += brick.radiance_weight[i] * brick.radiance[i];
      weights += brick.radiance_weight[i];
    }
    return weights > 0 ? (sum / weights).eval() : Vector3f::Zero().eval();
  };
  const auto moved = std::count_if(now.bricks.begin(), now.bricks.end(), [&](const auto& entry) {
    const FieldBrick* was = before.brick(entry.first);
    if (was == entry.second.get()) return false;
    if (!was) return true;
    const Vector3f then = mean(*was), here = mean(*entry.second);
    return (here - then).norm() > kOtherRadiance * std::max(here.norm(), then.norm());
  });
  return static_cast<float>(moved) / static_cast<float>(now.bricks.size());
}

AlbedoDelta compare_albedo(const AlbedoField& now, const AlbedoField& before) {
  double change = 0, sum = 0, sigma = 0, sigma_before = 0;
  std::size_t known = 0, fresh = 0;
  for (const auto& [key, brick] : now.bricks) {
    const auto was = before.bricks.find(key);
    for (std::size_t i = 0; i < brick->sigma.size(); ++i) {
      if (brick->sigma[i] < 0) continue;
      ++known;
      if (was == before.bricks.end() || was->second->sigma[i] < 0) {
        ++fresh;
        continue;
      }
      change += (brick->albedo[i] - was->second->albedo[i]).cwiseAbs().sum();
      sum += was->second->albedo[i].sum();
      sigma += brick->sigma[i];
      sigma_before += was->second->sigma[i];
    }
  }
  return {.change = sum > 0 ? static_cast<float>(change / sum) : 1,
          .newly_known = known > 0 ? static_cast<float>(fresh) / static_cast<float>(known) : 0,
          .surer = sigma_before > 0 ? static_cast<float>(1 - sigma / sigma_before) : 0};
}

}  // namespace lumigraft::reconstruct
