#include "reconstruct/fusion/brick_selection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "reconstruct/fusion/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

/// Brick of a position in voxels; lane 3 is unused.
Simd4Int brick_of(Simd4 voxel) {
  const Simd4 brick = voxel * (1.0f / kBrickEdge);
  const Simd4Int toward_zero = __builtin_convertvector(brick, Simd4Int);
  return toward_zero + (brick < __builtin_convertvector(toward_zero, Simd4));  // a comparison that is true gives −1
}

Simd4 four(const Vector3f& v) { return Simd4{v.x(), v.y(), v.z(), 0}; }

}  // namespace

std::vector<BrickKey> bricks_on_surfaces(const PreparedDepth& view, const DepthPreprocessor& preprocessor,
                                         const Eigen::Isometry3f& T_tag_camera, float voxel_m, float truncation_m,
                                         const ImageSubset& subset, RecentBricks& known) {
  std::vector<BrickKey> keys;
  const auto add = [&](const BrickKey& key) {
    if (known.insert(key)) keys.push_back(key);
  };
  const Simd4 origin = four(T_tag_camera.translation() / voxel_m);
  const std::array<Simd4, 3> axes = {four(T_tag_camera.linear().col(0)), four(T_tag_camera.linear().col(1)),
                                     four(T_tag_camera.linear().col(2))};
  const auto add_around = [&](int u, int v, const PreparedDepth::Block& block) {
    const std::int32_t pixel = view.pixel_index(2 * u, 2 * v);
    const Vector3f in_camera = preprocessor.ray(pixel).homogeneous();
    const Simd4 ray = axes[0] * in_camera.x() + axes[1] * in_camera.y() + axes[2] * in_camera.z();
    const float z = 1 / view.inverse_depth[static_cast<std::size_t>(pixel)];
    const Simd4 surface = origin + z / voxel_m * ray;
    // The cells around the surface need all their voxels.
    const Simd4Int low = brick_of(surface - 1.5f), high = brick_of(surface + 1.5f);
    const float band = std::min(truncation_m / block.normal.dot(in_camera), kDepthLookup.behind_grazing * truncation_m);
    const int steps = static_cast<int>(std::ceil(band / (4 * voxel_m)));
    const auto along_ray = [&](const auto& visit) {
      for (int first = 1; first <= steps; first += 4) {
        const Simd4 away =
            band * (broadcast(static_cast<float>(first)) + Simd4{0, 1, 2, 3}) / broadcast(static_cast<float>(steps));
        const Simd4 before = (z - away) / voxel_m, behind = (z + away) / voxel_m;
        for (int k = 0; k < std::min(4, steps + 1 - first); ++k) {
          visit(brick_of(origin + before[k] * ray));
          visit(brick_of(origin + behind[k] * ray));
        }
      }
    };
    // In most cases all bricks are known.
    bool all_known = known.contains_all(low, high);
    along_ray([&](Simd4Int at) { all_known &= known.contains(at); });
    if (all_known) return;
    for (int c = low[2]; c <= high[2]; ++c)
      for (int b = low[1]; b <= high[1]; ++b)
        for (int a = low[0]; a <= high[0]; ++a) add({a, b, c});
    along_ray([&](Simd4Int at) { add({at[0], at[1], at[2]}); });
  };
  // On a surface that is near and faces the camera one block in kStride² is enough.
  constexpr int kStride = kBrickSelection.block_stride;
  const auto stride_of = [&](int u, int v, const PreparedDepth::Block& block) {
    const float inverse_depth = view.inverse_depth[static_cast<std::size_t>(view.pixel_index(2 * u, 2 * v))];
    const float blocks =
        kBrickSelection.search_step_voxels * voxel_m * preprocessor.focal() * inverse_depth * block.facing / 2;
    return blocks >= kStride ? kStride : blocks >= 2 ? 2 : 1;
  };
  const auto block_at = [&](int u, int v) -> const PreparedDepth::Block& {
    return view.blocks[static_cast<std::size_t>(v * view.blocks_x + u)];
  };
  for (int v = 0; v < view.blocks_y; v += kStride)
    for (int u = 0; u < view.blocks_x; u += kStride) {
      if ((u + v) / kStride % subset.count != subset.index) continue;
      const PreparedDepth::Block& first = block_at(u, v);
      if (first.weight > 0 && first.jump < 0 && stride_of(u, v, first) == kStride) {
        add_around(u, v, first);
        continue;
      }
      for (int y = v; y < std::min(v + kStride, view.blocks_y); ++y)
        for (int x = u; x < std::min(u + kStride, view.blocks_x); ++x) {
          const PreparedDepth::Block& block = block_at(x, y);
          if (block.weight > 0 && ((x | y) & (stride_of(x, y, block) - 1)) == 0) add_around(x, y, block);
        }
    }
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

Vector3f brick_centre(const BrickKey& key, float voxel_m) {
  return voxel_m * (first_voxel(key).cast<float>() + Vector3f::Constant(0.5f * (kBrickEdge - 1)));
}

BrickVisibility brick_visibility(const BrickKey& key, const PreparedDepth& view, const PixelMap& map, float focal,
                                 const Eigen::Isometry3f& T_camera_tag, float voxel_m, float truncation_m) {
  const float radius_m = voxel_m * 0.5f * std::sqrt(3.0f) * (kBrickEdge - 1);
  const Vector3f centre = T_camera_tag * brick_centre(key, voxel_m);
  const float nearest = centre.z() - radius_m;
  if (centre.z() + radius_m < kBrickSelection.near_m) return {BrickVisibility::Kind::hidden};
  if (nearest < radius_m) return {BrickVisibility::Kind::surface, centre.z(), std::numeric_limits<float>::max()};
  const Vector2f pixel = map.pixel(centre.x() / centre.z(), centre.y() / centre.z());
  const float radius_px = radius_m / nearest * focal * 1.5f + 1;
  const auto tile = [](float at) { return static_cast<int>(std::floor(at / PreparedDepth::kTile)); };
  const int low_u = tile(pixel.x() - radius_px), high_u = tile(pixel.x() + radius_px);
  const int low_v = tile(pixel.y() - radius_px), high_v = tile(pixel.y() + radius_px);
  bool complete = low_u >= 0 && low_v >= 0 && high_u < view.tiles_x && high_v < view.tiles_y;
  float near_m = 1e9f, far_m = 0;
  for (int y = std::max(low_v, 0); y <= std::min(high_v, view.tiles_y - 1); ++y)
    for (int x = std::max(low_u, 0); x <= std::min(high_u, view.tiles_x - 1); ++x) {
      const PreparedDepth::Tile& at = view.tiles[static_cast<std::size_t>(y * view.tiles_x + x)];
      complete &= at.complete;
      if (at.far_m == 0) continue;
      far_m = std::max(far_m, at.far_m);
      near_m = std::min(near_m, at.near_m);
    }
  const float hidden_m = far_m + kDepthLookup.behind_grazing * truncation_m;
  if (nearest > hidden_m) return {BrickVisibility::Kind::hidden};
  if (complete && centre.z() + radius_m + kBrickSelection.open_truncations * truncation_m < near_m)
    return {BrickVisibility::Kind::open, centre.z()};
  return {BrickVisibility::Kind::surface, centre.z(), hidden_m, pixel, radius_px};
}

}  // namespace lumigraft::reconstruct
