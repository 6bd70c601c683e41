#include "reconstruct/shading/truncated_samples.h"

#include <cmath>
#include <map>

#include "reconstruct/field/radiance_bound.h"
#include "reconstruct/shading/parameters.h"

namespace lumigraft::reconstruct {
namespace {

struct Count {
  int measured = 0, clipped = 0;
};
using Counts = std::map<SampleCell, Count>;  ///< by cell, of all normals

SampleCell of_all_normals(SampleCell cell) {
  std::get<4>(cell) = 0;
  return cell;
}

bool clips(const FieldBrick& brick, std::size_t voxel, float voxel_m) {
  return brick.weight[voxel] > 0 && std::abs(brick.distance_m[voxel]) <= 0.5f * voxel_m &&
         radiance_is_bound(brick, voxel);
}

Counts counts_of(const DistanceField& field, const Surface& surface) {
  Counts counts;
  for (const auto& [key, brick] : field.bricks) {
    for (std::size_t i = 0; brick->color && i < kBrickVoxels; ++i) {
      if (!clips(*brick, i, field.voxel_m)) continue;
      SurfacePoint point;
      point.position = field.voxel_m * voxel_in(key, static_cast<int>(i)).cast<float>();
      point.normal = Eigen::Vector3f::UnitX();
      ++counts[of_all_normals(cell_of(point, surface.sample_m))].clipped;
    }
  }
  if (counts.empty()) return counts;
  for (const SurfacePoint& point : surface.points)
    if (!point.metal) ++counts[of_all_normals(cell_of(point, surface.sample_m))].measured;
  return counts;
}

}  // namespace

std::vector<bool> truncated_samples(const DistanceField& field, const Surface& surface) {
  std::vector<bool> truncated(surface.samples.size(), false);
  const Counts counts = counts_of(field, surface);
  for (std::size_t i = 0; !counts.empty() && i < truncated.size(); ++i) {
    const auto [level, x, y, z, axis] = surface.cells[i];
    Count around;
    for (int k = 0; k < 27; ++k) {
      const auto found = counts.find({level, x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1, 0});
      if (found == counts.end()) continue;
      around.measured += found->second.measured;
      around.clipped += found->second.clipped;
    }
    truncated[i] = static_cast<float>(around.clipped) >
                   kShadingParameters.samples.max_clipped * static_cast<float>(around.clipped + around.measured);
  }
  return truncated;
}

}  // namespace lumigraft::reconstruct
