#include "reconstruct/fusion/brick_update.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "reconstruct/fusion/depth_noise.h"
#include "reconstruct/math/simd8.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kShellVoxels = 1.5f;  // colour, and solidity at a rim, reach this far from the surface
constexpr Simd8 kAlong = {0, 1, 2, 3, 4, 5, 6, 7};
/// What is seen, free or a surface, so far from where it was (of the truncation distance) that noise does not explain
/// it has moved: then the past counts as so many looks. What lies hidden behind a surface denies nothing.
constexpr float kDenies = 0.75f, kDeniedLooks = 3;
/// Two sides of something thin differ by more than so much noise, and the field rises from one towards the other.
constexpr float kSideNoise = static_cast<float>(2.5 * kLeastSigmaM), kRises = 0.3f;

constexpr std::uint32_t kRowTurns = 4;  ///< looks, until it is a row's turn
constexpr float kFreeShare = 0.99f;     ///< of the truncation distance

constexpr float kDeniesNoise = static_cast<float>(4 * kLeastSigmaM);  // of a reading of weight 1

}  // namespace

/// Eight voxels in the camera's frame, and the pixels they are seen at.
struct BrickUpdate::Row {
  Simd8 x, y, z, u, v;
};

/// What the picture says about them.
struct BrickUpdate::Readings {
  Simd8 distance, weight;  ///< distance may be beyond truncation
  Simd8Int told;
  Simd8Int denies;  ///< lanes that may say that the past is gone; beside a jump another surface may be seen
  Simd8 facing;     ///< 0 = no colour
  Simd8Int edge;
  Simd8 normal[3];  ///< of the planes measured to, of any length, away from the camera
};

/// Where a reading and what was known cannot both hold.
struct BrickUpdate::Conflict {
  Simd8Int past_gone, reading_void;
};

/// What changed, over what a brick may drift; squared, summed over rows.
struct BrickUpdate::Squares {
  Simd8 sum{};
  float mean_root() const { return std::sqrt(sum_of(low_of(sum) + high_of(sum)) / kBrickVoxels); }
};

BrickUpdate::BrickUpdate(const PreparedDepth& view, const DepthPreparation& preparation, const PixelMap& map,
                         const ColorLookup& colour, const Eigen::Isometry3f& T_camera_tag, const Sizes& sizes,
                         bool wide)
    : view_(view),
      map_(map),
      colour_(colour),
      T_camera_tag_(T_camera_tag),
      sizes_(sizes),
      shell_m_(kShellVoxels * sizes.voxel_m),
      denies_m_(kDenies * sizes.truncation_m),
      end_u_(static_cast<float>(2 * view.blocks_x)),
      end_v_(static_cast<float>(2 * view.blocks_y)),
      near_m_((kDriftNearVoxels + kDriftMargin) * sizes.voxel_m),
      per_near_square_(1 / (kDriftNearShare * sizes.voxel_m * kDriftNearShare * sizes.voxel_m)),
      per_away_square_(1 / (kDriftAwayShare * sizes.voxel_m * kDriftAwayShare * sizes.voxel_m)),
      depth_(view, preparation, map, sizes.voxel_m, sizes.truncation_m, shell_m_),
      wide_(wide && has_eight()) {}

BrickUpdate::Told BrickUpdate::update(WorkingBrick& brick, float hidden_m, Wait wait) const {
  return wide_ ? update_wide(brick, hidden_m, wait) : update_rows(brick, hidden_m, wait);
}

LUMIGRAFT_EIGHT_WIDE BrickUpdate::Told BrickUpdate::update_wide(WorkingBrick& brick, float hidden_m, Wait wait) const {
  return update_rows(brick, hidden_m, wait);
}

[[gnu::always_inline]] inline BrickUpdate::Told BrickUpdate::update_rows(WorkingBrick& brick, float hidden_m,
                                                                         Wait wait) const {
  const Vector3f corner =
      T_camera_tag_ * (sizes_.voxel_m * kBrickEdge * Eigen::Map<const Eigen::Vector3i>(brick.key.data()).cast<float>());
  const Eigen::Matrix3f step = sizes_.voxel_m * T_camera_tag_.linear();
  const float free_m = kFreeShare * sizes_.truncation_m;
  Told told;
  Squares squares;
  const std::uint64_t in_turns = wait == Wait::nothing ? 0
                                 : wait == Wait::free  ? brick.free_rows
                                                       : brick.free_rows | brick.unobserved_rows;
  for (int z = 0; z < kBrickEdge; ++z)
    for (int y = 0; y < kBrickEdge; ++y) {
      const auto at_row = static_cast<std::uint32_t>(y + kBrickEdge * z);
      const std::uint64_t bit = std::uint64_t{1} << at_row;
      if ((in_turns & bit) && (at_row + brick.turn) % kRowTurns != 0) continue;
      const Vector3f row = corner + static_cast<float>(y) * step.col(1) + static_cast<float>(z) * step.col(2);
      if (std::min(row.z(), row.z() + kBrickEdge * step(2, 0)) > hidden_m) continue;
      Row at;
      at.x = row.x() + kAlong * step(0, 0);
      at.y = row.y() + kAlong * step(1, 0);
      at.z = row.z() + kAlong * step(2, 0);
      const Simd8 inverse_z = 1 / at.z;
      const Simd8 across = at.x * inverse_z, down = at.y * inverse_z;
      Simd4 u[2], v[2];
      map_.pixels(low_of(across), low_of(down), u[0], v[0]);
      map_.pixels(high_of(across), high_of(down), u[1], v[1]);
      at.u = joined(u[0], u[1]);
      at.v = joined(v[0], v[1]);
      const Readings readings = read(at);
      brick.free_rows &= ~bit;
      if (!any(readings.told)) {
        brick.unobserved_rows |= bit;
        continue;
      }
      brick.unobserved_rows &= ~bit;
      const std::size_t i = std::size_t{kBrickEdge} * at_row;
      fuse(brick.now, i, readings, told, squares);
      const Simd8Int free =
          readings.told & (readings.distance > free_m) & (load_eight(&brick.now.distance_m[i]) > free_m);
      if (!any(~free)) brick.free_rows |= bit;
      if (!colour_) continue;
      unsigned shell = bits_of((readings.facing > 0) & (size_of(readings.distance) <= shell_m_));
      for (; shell != 0; shell &= shell - 1) {
        const int k = std::countr_zero(shell);
        colour(brick.now, i + static_cast<std::size_t>(k), at.u[k], at.v[k], readings.edge[k] != 0, readings.facing[k],
               told);
      }
    }
  ++brick.turn;
  told.drift = squares.mean_root();
  told.radiance_drift = std::sqrt(told.radiance_drift);
  return told;
}

[[gnu::always_inline]] inline BrickUpdate::Readings BrickUpdate::read(const Row& at) const {
  const Simd8 u = at.u + 0.5f, v = at.v + 0.5f;
  const Simd8Int ahead = at.z >= kNearestM;
  const Simd8Int inside = ahead & (u >= 0) & (v >= 0) & (u < end_u_) & (v < end_v_);
  // Lanes that are outside read the first block.
  const Simd8Int block =
      (((__builtin_convertvector(v, Simd8Int) >> 1) * view_.blocks_x) + (__builtin_convertvector(u, Simd8Int) >> 1)) &
      inside;
  const auto plane = [&](int lane) { return view_.planes[static_cast<std::size_t>(block[lane])]; };
  Simd4 low[4] = {plane(0), plane(1), plane(2), plane(3)}, high[4] = {plane(4), plane(5), plane(6), plane(7)};
  transpose(low[0], low[1], low[2], low[3]);
  transpose(high[0], high[1], high[2], high[3]);
  const Simd8 a = joined(low[0], high[0]), b = joined(low[1], high[1]), c = joined(low[2], high[2]);
  // To the plane, not along the ray, so that distances hold at grazing views too.
  const Simd8 share_of_plane = a * at.x + b * at.y + c * at.z, plane_m = 1 / sqrt(a * a + b * b + c * c);
  Readings readings;
  readings.distance = (1 - share_of_plane) * plane_m;
  readings.weight = joined(low[3], high[3]);
  readings.normal[0] = a;
  readings.normal[1] = b;
  readings.normal[2] = c;
  readings.told = inside & (readings.weight > 0) & (readings.distance >= -sizes_.truncation_m) &
                  (readings.distance * at.z >= -kBehindSteep * sizes_.truncation_m * plane_m * share_of_plane);
  readings.denies = readings.told;
  readings.edge = Simd8Int{};
  readings.facing = Simd8{};
  const Simd8Int shell = readings.told & (size_of(readings.distance) <= shell_m_);
  if (colour_ && any(shell))
    readings.facing =
        select(shell, plane_m * share_of_plane / sqrt(at.x * at.x + at.y * at.y + at.z * at.z), readings.facing);
  const float to_m = depth_.beyond_to_m(), to_pixels = depth_.beyond_to_pixels();
  const Simd8Int beside = ahead & ~inside & (at.z <= to_m) & (at.u > -to_pixels) & (at.v > -to_pixels) &
                          (at.u < end_u_ + to_pixels) & (at.v < end_v_ + to_pixels);
  for (unsigned alone = bits_of(beside | (inside & (readings.weight < 0))); alone != 0; alone &= alone - 1) {
    const int k = std::countr_zero(alone);
    const Reading one = depth_.read({at.x[k], at.y[k], at.z[k]}, {at.u[k], at.v[k]});
    if (one.weight <= 0) continue;
    readings.distance[k] = one.distance_m;
    readings.weight[k] = one.weight;
    for (int axis = 0; axis < 3; ++axis) readings.normal[axis][k] = one.normal[axis];
    readings.told[k] = -1;
    readings.denies[k] = one.in_sight && !one.edge ? -1 : 0;
    readings.edge[k] = one.edge ? -1 : 0;
    if (one.in_sight) readings.facing[k] = one.facing * (one.edge ? kEdgeTrust : 1);
  }
  return readings;
}

/// Whether what is known of a voxel was seen from the other side than a surface with this normal (camera's frame): the
/// field rises along it.
bool BrickUpdate::from_other_side(const FieldBrick& brick, std::size_t i, const Vector3f& normal) const {
  const Vector3f in_tag = T_camera_tag_.linear().transpose() * normal;
  Eigen::Index axis;
  in_tag.cwiseAbs().maxCoeff(&axis);
  const std::size_t stride = std::size_t{1} << (3 * axis), at = i / stride % kBrickEdge;
  const std::size_t low = at == 0 ? i : i - stride, high = at + 1 == kBrickEdge ? i : i + stride;
  if (brick.weight[low] <= 0 || brick.weight[high] <= 0) return false;
  const float rise = brick.distance_m[high] - brick.distance_m[low];
  return (in_tag[axis] > 0 ? rise : -rise) > kRises * sizes_.voxel_m * static_cast<float>((high - low) / stride);
}

/// Noise is measured against all of the way, however far beyond truncation it goes: the farther something is seen, the
/// more noise hides in the truncation band. Of the two sides of something thin the nearer one tells: where that is the
/// reading, the past is gone; else the reading says nothing.
[[gnu::always_inline]] inline BrickUpdate::Conflict BrickUpdate::conflict(const FieldBrick& brick, std::size_t i,
                                                                          const Readings& readings) const {
  const Simd8 was = load_eight(&brick.distance_m[i]);
  const Simd8 found = min(readings.distance, all_eight(sizes_.truncation_m)), off = size_of(readings.distance - was);
  const Simd8 noises = off * off * readings.weight;
  Conflict result;
  result.past_gone = readings.denies & (size_of(found - was) > denies_m_) & (found > -shell_m_) &
                     (noises > kDeniesNoise * kDeniesNoise);
  result.reading_void = Simd8Int{};
  const Simd8Int apart = readings.told & (noises > kSideNoise * kSideNoise) & (load_eight(&brick.weight[i]) > 0);
  const Simd8Int nearer = readings.denies & apart & (found > was) & (was < 0);
  const Simd8Int farther = apart & (found < was) & (found < 0);
  for (unsigned thin = bits_of(nearer | farther); thin != 0; thin &= thin - 1) {
    const int k = std::countr_zero(thin);
    if (!from_other_side(brick, i + static_cast<std::size_t>(k),
                         {readings.normal[0][k], readings.normal[1][k], readings.normal[2][k]}))
      continue;
    result.past_gone[k] = nearer[k];
    result.reading_void[k] = ~nearer[k];
  }
  return result;
}

/// Into running means.
[[gnu::always_inline]] inline void BrickUpdate::fuse(FieldBrick& brick, std::size_t i, const Readings& readings,
                                                     Told& told, Squares& squares) const {
  const Simd8Int& read = readings.told;
  told.any = true;
  const Simd8 found = min(readings.distance, all_eight(sizes_.truncation_m));
  const Simd8 was = load_eight(&brick.distance_m[i]), past = load_eight(&brick.weight[i]);
  const Simd8Int known = past > 0;
  told.learnt += std::popcount(bits_of(read & ~known));
  told.moved += std::popcount(bits_of(read & known & (size_of(was - found) > sizes_.truncation_m)));
  const Conflict conflicts = conflict(brick, i, readings);
  const Simd8 share = select(read & ~conflicts.reading_void, readings.weight, Simd8{});
  const Simd8 sum = select(conflicts.past_gone, min(past, kDeniedLooks * share), past) + share;
  const Simd8 turn = share / select(read, sum, all_eight(1));
  const Simd8 step = turn * (select(read, found, was) - was), now = was + step;
  const Simd8Int near = min(size_of(was), size_of(now)) < near_m_;
  squares.sum += step * step * select(near, all_eight(per_near_square_), all_eight(per_away_square_));
  store(&brick.distance_m[i], now);
  store(&brick.weight[i], select(read, min(sum, all_eight(sizes_.weight_cap)), past));
}

void BrickUpdate::fetch(const WorkingBrick& brick, const Sight& sight) const {
  constexpr int kLine = 64;  // bytes
  const auto within = [](float at, int end) { return std::clamp(static_cast<int>(at), 0, end - 1); };
  const float reach = 0.7f * sight.reach;
  const int low_u = within(sight.pixel.x() - reach, view_.width), high_u = within(sight.pixel.x() + reach, view_.width);
  const int low_v = within(sight.pixel.y() - reach, view_.height),
            high_v = within(sight.pixel.y() + reach, view_.height);
  for (int v = low_v / 2; v <= std::min(high_v / 2, view_.blocks_y - 1); ++v)
    for (int u = low_u / 2; u <= std::min(high_u / 2, view_.blocks_x - 1); u += kLine / 16)
      __builtin_prefetch(&view_.planes[static_cast<std::size_t>(v * view_.blocks_x + u)]);
  if (colour_)
    for (int v = low_v; v <= high_v; ++v)
      for (int u = low_u; u <= high_u; u += kLine / 3) colour_.fetch(u, v);
  for (std::size_t i = 0; i < kBrickVoxels; i += kLine / 4) {
    __builtin_prefetch(&brick.now.distance_m[i], 1);
    __builtin_prefetch(&brick.now.weight[i], 1);
  }
}

/// Running mean; the past counts for the cap at most.
[[gnu::always_inline]] inline void BrickUpdate::colour(FieldBrick& brick, std::size_t i, float u, float v, bool nearest,
                                                       float share, Told& told) const {
  Simd4 radiance;
  if (!colour_.read(u, v, nearest, radiance)) return;
  Vector3f& mean = brick.radiance[i];
  const float sum = brick.radiance_weight[i] + share;
  const Vector3f step = share / sum * (Vector3f(radiance[0], radiance[1], radiance[2]) - mean);
  told.coloured |= brick.radiance_weight[i] <= 0;
  told.radiance_drift += step.squaredNorm();
  mean += step;
  brick.radiance_weight[i] = std::min(sum, sizes_.weight_cap);
}

BrickUpdate::Told BrickUpdate::clear(WorkingBrick& brick) const {
  if (brick.open) return {};
  const Vector3f centre = T_camera_tag_ * middle_of(brick.key, sizes_.voxel_m);
  const Vector2f pixel = map_.pixel(centre.x() / centre.z(), centre.y() / centre.z());
  const float share = view_.block_of(static_cast<int>(pixel.x()), static_cast<int>(pixel.y())).weight;
  if (share <= 0) return {};
  Told told;
  Squares squares;
  Readings readings;
  readings.distance = all_eight(kOpenReach * sizes_.truncation_m);
  readings.weight = all_eight(share);
  readings.told = readings.denies = ~Simd8Int{};
  readings.facing = Simd8{};
  readings.edge = Simd8Int{};
  for (Simd8& axis : readings.normal) axis = Simd8{};
  Simd8Int free = ~Simd8Int{};
  for (std::size_t i = 0; i < kBrickVoxels; i += kBrickEdge) {
    fuse(brick.now, i, readings, told, squares);
    free &= load_eight(&brick.now.distance_m[i]) > kFreeShare * sizes_.truncation_m;
  }
  told.drift = squares.mean_root();
  brick.open = !any(~free);
  return told;
}

}  // namespace lumigraft::reconstruct
