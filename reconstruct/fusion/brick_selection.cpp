#include "reconstruct/fusion/brick_selection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "reconstruct/fusion/parameters.h"
#include "reconstruct/math/simd8.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

/// Brick of a position in voxels; lane 3 is unused.
Simd4Int brick_of(Simd4 voxel) {
  const Simd4 brick = voxel * (1.0f / kBrickEdge);
  const Simd4Int toward_zero = __builtin_convertvector(brick, Simd4Int);
  return toward_zero + (brick < __builtin_convertvector(toward_zero, Simd4));  // a comparison that is true gives −1
}

[[gnu::always_inline]] inline float min_of(Simd8 x) {
  const Simd4 four = min(low_half(x), high_half(x));
  return std::min(std::min(four[0], four[1]), std::min(four[2], four[3]));
}
[[gnu::always_inline]] inline float max_of(Simd8 x) {
  const Simd4 four = max(low_half(x), high_half(x));
  return std::max(std::max(four[0], four[1]), std::max(four[2], four[3]));
}

/// BrickVisibility::surface_offset. `centre`: camera frame, in front of the camera. `step`: of a voxel along each axis.
float surface_offset(const PreparedDepth& view, const PixelMap& map, const Vector3f& centre,
                     const Eigen::Matrix3f& step) {
  const Eigen::Vector2f pixel = map.pixel(centre.x() / centre.z(), centre.y() / centre.z());
  const int u = std::clamp(static_cast<int>(pixel.x()), 0, view.width - 1);
  const int v = std::clamp(static_cast<int>(pixel.y()), 0, view.height - 1);
  const PreparedDepth::Block& block = view.block_of(u, v);
  const float inverse_depth = view.inverse_depth[static_cast<std::size_t>(view.pixel_index(u, v))];
  if (block.weight <= 0 && inverse_depth == 0) return 1;
  const Vector3f normal = block.weight > 0 ? block.normal : Vector3f::UnitZ();
  const float plane_m = block.weight > 0 ? block.distance_m : 1 / inverse_depth;
  const float reach_m = 0.5f * kBrickEdge * (step.transpose() * normal).cwiseAbs().sum();
  return (plane_m - normal.dot(centre)) / reach_m;
}

Simd4 four(const Vector3f& v) { return Simd4{v.x(), v.y(), v.z(), 0}; }

}  // namespace

std::vector<BrickKey> bricks_on_surfaces(const PreparedDepth& view, const DepthPreprocessor& preprocessor,
                                         const Eigen::Isometry3f& T_tag_camera, float voxel_m, float truncation_m,
                                         const ImageSubset& subset, const DepthRange& range_m, RecentBricks& known) {
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
    if (z < range_m.from_m || z > range_m.to_m) return;
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
  constexpr float kHalf = 0.5f * (kBrickEdge - 1);  // voxels, from the centre to the outermost ones
  constexpr Simd8 kX = {-kHalf, kHalf, -kHalf, kHalf, -kHalf, kHalf, -kHalf, kHalf},
                  kY = {-kHalf, -kHalf, kHalf, kHalf, -kHalf, -kHalf, kHalf, kHalf},
                  kZ = {-kHalf, -kHalf, -kHalf, -kHalf, kHalf, kHalf, kHalf, kHalf};
  const Vector3f centre = T_camera_tag * brick_centre(key, voxel_m);
  const Eigen::Matrix3f step = voxel_m * T_camera_tag.linear();
  const auto corners = [&](int axis) __attribute__((always_inline)) {
    return centre[axis] + step(axis, 0) * kX + step(axis, 1) * kY + step(axis, 2) * kZ;
  };
  const Simd8 z = corners(2);
  const float near_m = min_of(z), far_m = max_of(z);
  if (far_m < kBrickSelection.near_m) return {BrickVisibility::Kind::hidden};
  if (near_m < kBrickSelection.near_m)
    return {BrickVisibility::Kind::surface, centre.z(), std::numeric_limits<float>::max()};
  const Simd8 across = corners(0) / z, down = corners(1) / z;
  Simd4 u[2], v[2];
  map.pixels(low_half(across), low_half(down), u[0], v[0]);
  map.pixels(high_half(across), high_half(down), u[1], v[1]);
  // A distorted brick exceeds the box of its corners a little.
  const float low_u = min_of(join(u[0], u[1])) - 1, high_u = max_of(join(u[0], u[1])) + 1;
  const float low_v = min_of(join(v[0], v[1])) - 1, high_v = max_of(join(v[0], v[1])) + 1;
  const float end_u = static_cast<float>(view.width), end_v = static_cast<float>(view.height);
  // Voxels just outside the image are observed too (DepthLookup::outside_image).
  const float margin_px = kDepthLookup.rim_voxels * voxel_m * focal / near_m;
  if (!(high_u + margin_px >= 0 && low_u - margin_px < end_u && high_v + margin_px >= 0 && low_v - margin_px < end_v))
    return {BrickVisibility::Kind::hidden};
  const auto clamped = [](float at, int size) { return std::clamp(static_cast<int>(at), 0, size - 1); };
  BrickVisibility result{BrickVisibility::Kind::hidden, centre.z()};
  result.first_u = clamped(low_u, view.width);
  result.last_u = clamped(high_u, view.width);
  result.first_v = clamped(low_v, view.height);
  result.last_v = clamped(high_v, view.height);
  bool complete = low_u >= 0 && low_v >= 0 && high_u < end_u && high_v < end_v;
  float surface_m = std::numeric_limits<float>::max();
  for (int y = result.first_v / PreparedDepth::kTile; y <= result.last_v / PreparedDepth::kTile; ++y)
    for (int x = result.first_u / PreparedDepth::kTile; x <= result.last_u / PreparedDepth::kTile; ++x) {
      const PreparedDepth::Tile& at = view.tiles[static_cast<std::size_t>(y * view.tiles_x + x)];
      complete &= at.complete;
      result.jumps |= at.jumps;
      result.hidden_m = std::max(result.hidden_m, at.hidden_m);
      if (at.near_m > 0) surface_m = std::min(surface_m, at.near_m);
    }
  if (near_m > result.hidden_m) return result;
  const bool open = complete && far_m + kBrickSelection.open_truncations * truncation_m < surface_m;
  result.surface_offset = surface_offset(view, map, centre, step);
  result.kind = open ? BrickVisibility::Kind::open : BrickVisibility::Kind::surface;
  return result;
}

}  // namespace lumigraft::reconstruct
