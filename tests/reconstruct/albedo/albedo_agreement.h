#pragma once
// Difference of two solutions of one room.
#include <algorithm>
#include <cmath>

#include "reconstruct/albedo/albedo.h"

namespace lumigraft::reconstruct {

/// Over all voxels known to at least one of them.
struct Agreement {
  double within_sigma = 0;  ///< fraction whose RMS difference over channels is within the second's 1σ
  double mean = 0;          ///< mean of the first over that of the second
  double known = 0;         ///< fraction known to both
};
inline Agreement agreement(const AlbedoField& a, const AlbedoField& b) {
  Agreement result;
  double both = 0, either = 0, sum_a = 0, sum_b = 0;
  const auto known = [](const AlbedoField& field, const BrickKey& key, int i) {
    const auto brick = field.bricks.find(key);
    return brick != field.bricks.end() && brick->second->sigma[i] >= 0 ? brick->second.get() : nullptr;
  };
  for (const auto* field : {&a, &b}) {
    for (const auto& [key, brick] : field->bricks) {
      for (int i = 0; i < kBrickVoxels; ++i) {
        const AlbedoBrick *one = known(a, key, i), *other = known(b, key, i);
        if ((!one && !other) || (field == &b && one)) continue;
        ++either;
        if (!one || !other) continue;
        ++both;
        const Eigen::Vector3f off = one->albedo[i] - other->albedo[i];
        result.within_sigma += off.norm() <= std::sqrt(3.0f) * other->sigma[i];
        sum_a += one->albedo[i].mean();
        sum_b += other->albedo[i].mean();
      }
    }
  }
  result.within_sigma /= std::max(both, 1.0);
  result.mean = sum_a / sum_b;
  result.known = both / std::max(either, 1.0);
  return result;
}

}  // namespace lumigraft::reconstruct
