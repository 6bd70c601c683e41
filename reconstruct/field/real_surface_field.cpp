#include "reconstruct/field/real_surface_field.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "reconstruct/field/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

/// The nearest point of a triangle (Ericson 2005, "Real-Time Collision Detection", §5.1.5).
Vector3f nearest_on(const SurfaceTriangle& t, const Vector3f& p) {
  const Vector3f ab = t[1] - t[0], ac = t[2] - t[0], ap = p - t[0], bp = p - t[1], cp = p - t[2];
  const float d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d1 <= 0 && d2 <= 0) return t[0];
  if (d3 >= 0 && d4 <= d3) return t[1];
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return t[0] + d1 / (d1 - d3) * ab;
  if (d6 >= 0 && d5 <= d6) return t[2];
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return t[0] + d2 / (d2 - d6) * ac;
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return t[1] + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (t[2] - t[1]);
  const float sum = va + vb + vc;
  return t[0] + vb / sum * ab + vc / sum * ac;
}

/// The nearest triangle so far. Of equally near ones the one whose normal is most parallel to the direction to the
/// voxel counts, so that the sign is right at edges.
struct Nearest {
  float distance_m = 1e9f, cosine = 0;  ///< unsigned distance; cosine between normal and direction to the voxel, signed
};

}  // namespace

DistanceField field_of(const std::vector<SurfaceTriangle>& triangles, float voxel_m, float band_m) {
  using Bricks = std::map<BrickKey, std::array<Nearest, kBrickVoxels>>;
  Bricks found;
  Bricks::value_type* brick = nullptr;  // of the previous voxel
  for (const SurfaceTriangle& triangle : triangles) {
    const Vector3f across = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
    if (!(across.norm() > 0)) continue;
    const Vector3f normal = across.normalized();
    const auto voxel_of = [&](const Vector3f& p) {
      return Eigen::Vector3i((p / voxel_m).array().floor().matrix().cast<int>());
    };
    const Eigen::Vector3i low =
        voxel_of(triangle[0].cwiseMin(triangle[1]).cwiseMin(triangle[2]) - Vector3f::Constant(band_m));
    const Eigen::Vector3i high =
        voxel_of(triangle[0].cwiseMax(triangle[1]).cwiseMax(triangle[2]) + Vector3f::Constant(band_m));
    for (int z = low.z(); z <= high.z(); ++z)
      for (int y = low.y(); y <= high.y(); ++y)
        for (int x = low.x(); x <= high.x(); ++x) {
          const Vector3f p = voxel_m * Vector3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
          if (std::abs(normal.dot(p - triangle[0])) > band_m) continue;
          const Vector3f from = p - nearest_on(triangle, p);
          const float distance_m = from.norm();
          if (distance_m > band_m) continue;
          const float cosine = distance_m > 1e-6f ? normal.dot(from) / distance_m : 1;
          const BrickKey key{x >> 3, y >> 3, z >> 3};
          if (!brick || key != brick->first) brick = &*found.try_emplace(key).first;
          Nearest& nearest = brick->second[static_cast<std::size_t>((x & 7) + 8 * (y & 7) + 64 * (z & 7))];
          if (distance_m > nearest.distance_m + kFieldParameters.equal_distance_m) continue;
          if (distance_m > nearest.distance_m - kFieldParameters.equal_distance_m &&
              std::abs(cosine) <= std::abs(nearest.cosine))
            continue;
          nearest = {distance_m, cosine};
        }
  }
  DistanceField field;
  field.voxel_m = voxel_m;
  field.truncation_m = band_m;
  for (const auto& [key, voxels] : found) {
    auto distances = std::make_shared<FieldBrick>();
    for (std::size_t i = 0; i < kBrickVoxels; ++i) {
      if (std::abs(voxels[i].cosine) < kFieldParameters.min_triangle_cosine) continue;
      distances->distance_m[i] = std::copysign(voxels[i].distance_m, voxels[i].cosine);
      distances->weight[i] = 1;
    }
    field.bricks.emplace(key, std::move(distances));
  }
  return field;
}

}  // namespace lumigraft::reconstruct
