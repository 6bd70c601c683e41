#include "relight/objects/far_distance.h"

#include <algorithm>
#include <cmath>

#include "relight/objects/nearest_cells.h"
#include "relight/objects/parameters.h"

namespace lumigraft::relight {
std::vector<float> full_distances(const ObjectField& field) {
  std::vector<NearestCell> seeds(field.distance_m.size());
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    if (std::abs(field.distance_m[i]) <= kObjects.seed_voxels * field.voxel_m) seeds[i].point = static_cast<int>(i);
  }
  spread_nearest(seeds, Eigen::Vector3i::Map(field.size.data()));

  std::vector<float> full(seeds.size());
  for (std::size_t i = 0; i < full.size(); ++i) {
    const float near = field.distance_m[i];
    const bool found = seeds[i].point != NearestCell::kNone;
    const float squared = found ? std::min(static_cast<float>(seeds[i].squared), kObjects.max_far2) : kObjects.max_far2;
    const float far = (std::sqrt(squared) - kObjects.seed_voxels) * field.voxel_m;
    full[i] = std::copysign(std::max(std::abs(near), far), near);
    if (std::abs(near) < 2.5f * field.voxel_m) full[i] = near;
  }
  return full;
}

}  // namespace lumigraft::relight
