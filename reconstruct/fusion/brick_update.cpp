#include "reconstruct/fusion/brick_update.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

#include "reconstruct/fusion/parameters.h"
#include "reconstruct/math/depth_noise.h"
#include "reconstruct/math/simd8.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr Simd8 kLanes = {0, 1, 2, 3, 4, 5, 6, 7};
// Thresholds in metres for a measurement of weight 1.
constexpr float kOverrule_m = static_cast<float>(kBrickUpdate.overrule_sigmas * kMinDepthSigma_m);
constexpr float kSide_m = static_cast<float>(kBrickUpdate.side_sigmas * kMinDepthSigma_m);

}  // namespace

/// Eight voxels in the camera frame, metres, and their pixels.
struct BrickUpdate::Row {
  Simd8 x, y, z, u, v;
};

/// Observations of eight voxels.
struct BrickUpdate::Readings {
  Simd8 distance, weight;  ///< distance (metres) may exceed the truncation distance
  Simd8Int observed;
  Simd8Int may_overrule;  ///< lanes that may overrule the past; not near a jump, where another surface may be meant
  Simd8 facing;           ///< 0 = no colour
  Simd8Int edge;
  Simd8 normal[3];  ///< of the observed planes, not normalised, away from the camera
};

/// Lanes in which the observation and the past exclude each other.
struct BrickUpdate::Conflict {
  Simd8Int reset_past, ignore_reading;
};

/// Squared changes relative to the allowed drift, summed over rows.
struct BrickUpdate::DriftSum {
  Simd8 sum{};
  float rms() const { return std::sqrt(sum_of(low_half(sum) + high_half(sum)) / kBrickVoxels); }
};

BrickUpdate::BrickUpdate(const PreparedDepth& view, const DepthPreprocessor& preprocessor, const PixelMap& map,
                         const ColorLookup& colour, const Eigen::Isometry3f& T_camera_tag, const Sizes& sizes,
                         bool wide)
    : view_(view),
      map_(map),
      colour_(colour),
      T_camera_tag_(T_camera_tag),
      sizes_(sizes),
      shell_m_(kBrickUpdate.shell_voxels * sizes.voxel_m),
      overrule_m_(kBrickUpdate.overrule_truncations * sizes.truncation_m),
      end_u_(static_cast<float>(2 * view.blocks_x)),
      end_v_(static_cast<float>(2 * view.blocks_y)),
      near_m_((kPublication.near_voxels + kPublication.near_margin_voxels) * sizes.voxel_m),
      per_near_square_(
          1 / (kPublication.drift_near_voxels * sizes.voxel_m * kPublication.drift_near_voxels * sizes.voxel_m)),
      per_away_square_(
          1 / (kPublication.drift_away_voxels * sizes.voxel_m * kPublication.drift_away_voxels * sizes.voxel_m)),
      depth_(view, preprocessor, map, sizes.voxel_m, sizes.truncation_m, shell_m_),
      wide_(wide && simd8_supported()) {}

BrickUpdate::Change BrickUpdate::update(WorkingBrick& brick, float hidden_m, const FieldBrickMaker& maker) const {
  return wide_ ? update_wide(brick, hidden_m, maker) : update_rows(brick, hidden_m, maker);
}

LUMIGRAFT_SIMD8_TARGET BrickUpdate::Change BrickUpdate::update_wide(WorkingBrick& brick, float hidden_m,
                                                                    const FieldBrickMaker& maker) const {
  return update_rows(brick, hidden_m, maker);
}

[[gnu::always_inline]] inline BrickUpdate::Change BrickUpdate::update_rows(WorkingBrick& brick, float hidden_m,
                                                                           const FieldBrickMaker& maker) const {
  const Vector3f corner = T_camera_tag_ * (sizes_.voxel_m * first_voxel(brick.key).cast<float>());
  const Eigen::Matrix3f step = sizes_.voxel_m * T_camera_tag_.linear();
  Change change;
  DriftSum drift;
  for (int z = 0; z < kBrickEdge; ++z)
    for (int y = 0; y < kBrickEdge; ++y) {
      const Vector3f row = corner + static_cast<float>(y) * step.col(1) + static_cast<float>(z) * step.col(2);
      if (std::min(row.z(), row.z() + kBrickEdge * step(2, 0)) > hidden_m) continue;
      Row at;
      at.x = row.x() + kLanes * step(0, 0);
      at.y = row.y() + kLanes * step(1, 0);
      at.z = row.z() + kLanes * step(2, 0);
      const Simd8 inverse_z = 1 / at.z;
      const Simd8 across = at.x * inverse_z, down = at.y * inverse_z;
      Simd4 u[2], v[2];
      map_.pixels(low_half(across), low_half(down), u[0], v[0]);
      map_.pixels(high_half(across), high_half(down), u[1], v[1]);
      at.u = join(u[0], u[1]);
      at.v = join(v[0], v[1]);
      const Readings readings = read(at);
      if (!any(readings.observed)) continue;
      if (!change.observed) brick.prepare_change(maker);
      const auto i = static_cast<std::size_t>(kBrickEdge * (y + kBrickEdge * z));
      fuse(*brick.now, i, readings, change, drift);
      if (!colour_) continue;
      unsigned shell = lane_mask((readings.facing > 0) & (abs(readings.distance) <= shell_m_));
      for (; shell != 0; shell &= shell - 1) {
        const int k = std::countr_zero(shell);
        fuse_color(brick, i + static_cast<std::size_t>(k), at.u[k], at.v[k], readings.edge[k] != 0, readings.facing[k],
                   maker, change);
      }
    }
  change.drift = drift.rms();
  change.radiance_drift = std::sqrt(change.radiance_drift);
  return change;
}

[[gnu::always_inline]] inline BrickUpdate::Readings BrickUpdate::read(const Row& at) const {
  const Simd8 u = at.u + 0.5f, v = at.v + 0.5f;
  const Simd8Int ahead = at.z >= kBrickSelection.near_m;
  const Simd8Int inside = ahead & (u >= 0) & (v >= 0) & (u < end_u_) & (v < end_v_);
  // Lanes outside the image read the first block.
  const Simd8Int block =
      (((__builtin_convertvector(v, Simd8Int) >> 1) * view_.blocks_x) + (__builtin_convertvector(u, Simd8Int) >> 1)) &
      inside;
  const auto plane = [&](int lane) { return view_.planes[static_cast<std::size_t>(block[lane])]; };
  Simd4 low[4] = {plane(0), plane(1), plane(2), plane(3)}, high[4] = {plane(4), plane(5), plane(6), plane(7)};
  transpose(low[0], low[1], low[2], low[3]);
  transpose(high[0], high[1], high[2], high[3]);
  const Simd8 a = join(low[0], high[0]), b = join(low[1], high[1]), c = join(low[2], high[2]);
  const auto of_blocks = [&](const std::vector<float>& values) __attribute__((always_inline)) {
    const auto value = [&](int lane) { return values[static_cast<std::size_t>(block[lane])]; };
    return Simd8{value(0), value(1), value(2), value(3), value(4), value(5), value(6), value(7)};
  };
  // Distances are to the plane, not along the ray, so that they are right at grazing angles too.
  const Simd8 depth_ratio = a * at.x + b * at.y + c * at.z, plane_m = join(low[3], high[3]);
  const Simd8 weight = of_blocks(view_.plane_weights);
  const Simd8Int needs_jump = weight == PreparedDepth::kJump;
  Readings readings;
  readings.distance = (1 - depth_ratio) * plane_m;
  readings.weight = abs(weight);
  readings.normal[0] = a;
  readings.normal[1] = b;
  readings.normal[2] = c;
  readings.observed =
      inside & (readings.weight > 0) & (readings.distance >= -sizes_.truncation_m) &
      (readings.distance * at.z >= -kDepthLookup.behind_grazing * sizes_.truncation_m * plane_m * depth_ratio);
  Simd8Int at_jump = (weight < 0) & readings.observed & (readings.distance <= shell_m_) & ~needs_jump;
  if (any(needs_jump)) {
    at_jump |= needs_jump & (at.z <= of_blocks(view_.jump_depth_m));
    readings.observed &= ~needs_jump;
  }
  at_jump &= inside;
  readings.observed &= ~at_jump;
  readings.may_overrule = readings.observed;
  readings.edge = Simd8Int{};
  readings.facing = Simd8{};
  const Simd8Int shell = readings.observed & (abs(readings.distance) <= shell_m_);
  if (colour_ && any(shell))
    readings.facing =
        select(shell, plane_m * depth_ratio / sqrt(at.x * at.x + at.y * at.y + at.z * at.z), readings.facing);
  const float max_m = depth_.extrapolation_depth_m(), margin_px = depth_.extrapolation_px();
  const Simd8Int outside = ahead & ~inside & (at.z <= max_m) & (at.u > -margin_px) & (at.v > -margin_px) &
                           (at.u < end_u_ + margin_px) & (at.v < end_v_ + margin_px);
  for (unsigned single = lane_mask(outside | at_jump); single != 0; single &= single - 1) {
    const int k = std::countr_zero(single);
    const Vector3f p(at.x[k], at.y[k], at.z[k]);
    const DepthReading one = at_jump[k] ? depth_.near_jump(p, static_cast<int>(u[k]), static_cast<int>(v[k]))
                                        : depth_.read(p, {at.u[k], at.v[k]});
    if (one.weight <= 0) continue;
    readings.distance[k] = one.distance_m;
    readings.weight[k] = one.weight;
    for (int axis = 0; axis < 3; ++axis) readings.normal[axis][k] = one.normal[axis];
    readings.observed[k] = -1;
    readings.may_overrule[k] = one.visible && !one.edge ? -1 : 0;
    readings.edge[k] = one.edge ? -1 : 0;
    if (one.visible) readings.facing[k] = one.facing * (one.edge ? kDepthLookup.edge_weight : 1);
  }
  return readings;
}

/// Whether a voxel was observed from the other side of a surface with this normal (camera frame): then the field rises
/// along the normal.
bool BrickUpdate::from_other_side(const FieldBrick& brick, std::size_t i, const Vector3f& normal) const {
  const Vector3f in_tag = T_camera_tag_.linear().transpose() * normal;
  Eigen::Index axis;
  in_tag.cwiseAbs().maxCoeff(&axis);
  const std::size_t stride = std::size_t{1} << (3 * axis), at = i / stride % kBrickEdge;
  const std::size_t low = at == 0 ? i : i - stride, high = at + 1 == kBrickEdge ? i : i + stride;
  if (brick.weight[low] <= 0 || brick.weight[high] <= 0) return false;
  const float rise = brick.distance_m[high] - brick.distance_m[low];
  return (in_tag[axis] > 0 ? rise : -rise) >
         kBrickUpdate.side_slope * sizes_.voxel_m * static_cast<float>((high - low) / stride);
}

/// A visible change, free or a surface, that noise does not explain overrules the past; what is hidden behind a surface
/// does not. Noise is compared with the untruncated difference, since far away it exceeds the truncation distance. Of
/// the two sides of a thin object the nearer one counts: if that is the observation, the past is reset, else the
/// observation is ignored.
[[gnu::always_inline]] inline BrickUpdate::Conflict BrickUpdate::conflict(const FieldBrick& brick, std::size_t i,
                                                                          const Readings& readings) const {
  const Simd8 was = load8(&brick.distance_m[i]);
  const Simd8 found = min(readings.distance, broadcast8(sizes_.truncation_m)),
              difference = abs(readings.distance - was);
  const Simd8 weighted_square = difference * difference * readings.weight;
  Conflict result;
  result.reset_past = readings.may_overrule & (abs(found - was) > overrule_m_) & (found > -shell_m_) &
                      (weighted_square > kOverrule_m * kOverrule_m);
  result.ignore_reading = Simd8Int{};
  const Simd8Int apart = readings.observed & (weighted_square > kSide_m * kSide_m) & (load8(&brick.weight[i]) > 0);
  const Simd8Int nearer = readings.may_overrule & apart & (found > was) & (was < 0);
  const Simd8Int farther = apart & (found < was) & (found < 0);
  for (unsigned thin = lane_mask(nearer | farther); thin != 0; thin &= thin - 1) {
    const int k = std::countr_zero(thin);
    if (!from_other_side(brick, i + static_cast<std::size_t>(k),
                         {readings.normal[0][k], readings.normal[1][k], readings.normal[2][k]}))
      continue;
    result.reset_past[k] = nearer[k];
    result.ignore_reading[k] = ~nearer[k];
  }
  return result;
}

/// Weighted running mean of the distance.
[[gnu::always_inline]] inline void BrickUpdate::fuse(FieldBrick& brick, std::size_t i, const Readings& readings,
                                                     Change& change, DriftSum& drift) const {
  const Simd8Int& read = readings.observed;
  change.observed = true;
  const Simd8 found = min(readings.distance, broadcast8(sizes_.truncation_m));
  const Simd8 was = load8(&brick.distance_m[i]), past = load8(&brick.weight[i]);
  const Simd8Int known = past > 0;
  change.new_voxels += std::popcount(lane_mask(read & ~known));
  change.moved_voxels += std::popcount(lane_mask(read & known & (abs(was - found) > sizes_.truncation_m)));
  const Conflict conflicts = conflict(brick, i, readings);
  const Simd8 weight = select(read & ~conflicts.ignore_reading, readings.weight, Simd8{});
  const Simd8 sum = select(conflicts.reset_past, min(past, kBrickUpdate.past_updates * weight), past) + weight;
  const Simd8 fraction = weight / select(read, sum, broadcast8(1));
  const Simd8 step = fraction * (select(read, found, was) - was), now = was + step;
  const Simd8Int near = min(abs(was), abs(now)) < near_m_;
  drift.sum += step * step * select(near, broadcast8(per_near_square_), broadcast8(per_away_square_));
  ++change.rows;
  change.solid |= any((now < 0) & (read | known));
  store(&brick.distance_m[i], now);
  store(&brick.weight[i], select(read, min(sum, broadcast8(sizes_.weight_cap)), past));
}

void BrickUpdate::prefetch(const WorkingBrick& brick, const BrickVisibility& visibility) const {
  constexpr std::ptrdiff_t kLine = 64;  // bytes
  const auto prefetch_range = [](const auto* first, const auto* last) {
    const auto* from = reinterpret_cast<const std::byte*>(first);
    const auto* to = reinterpret_cast<const std::byte*>(last);
    for (; from < to; from += kLine) __builtin_prefetch(from);
    __builtin_prefetch(to);
  };
  const int low_u = visibility.first_u, high_u = visibility.last_u;
  const int low_x = low_u / 2, high_x = std::min(high_u / 2, view_.blocks_x - 1);
  for (int y = visibility.first_v / 2; y <= std::min(visibility.last_v / 2, view_.blocks_y - 1); ++y) {
    const auto row = static_cast<std::size_t>(y) * static_cast<std::size_t>(view_.blocks_x);
    const std::size_t first = row + static_cast<std::size_t>(low_x), last = row + static_cast<std::size_t>(high_x);
    prefetch_range(&view_.planes[first], &view_.planes[last]);
    prefetch_range(&view_.plane_weights[first], &view_.plane_weights[last]);
    if (visibility.jumps) prefetch_range(&view_.blocks[first], &view_.blocks[last].jump);
  }
  for (int v = visibility.first_v; v <= visibility.last_v; ++v) {
    const float* row = view_.inverse_depth.data() + std::ptrdiff_t{v} * view_.width;
    if (visibility.jumps) prefetch_range(row + low_u, row + high_u);
    if (colour_) colour_.prefetch(low_u, high_u, v);
  }
  if (!brick.now) return;
  for (std::size_t i = 0; i < kBrickVoxels; i += kLine / 4) {
    __builtin_prefetch(&brick.now->distance_m[i], 1);
    __builtin_prefetch(&brick.now->weight[i], 1);
  }
}

/// Weighted running mean of the radiance.
[[gnu::always_inline]] inline void BrickUpdate::fuse_color(WorkingBrick& brick, std::size_t i, float u, float v,
                                                           bool nearest, float weight, const FieldBrickMaker& maker,
                                                           Change& change) const {
  Simd4 radiance{};
  const bool clipped = !colour_.read(u, v, nearest, radiance);
  if (clipped && !(radiance[3] > 0)) return;
  BrickColor& color = brick.prepare_color(maker);
  Vector3f& mean = color.radiance[i];
  if (clipped) {
    if (color.weight[i] > 0) return;
    mean = mean.cwiseMax(Vector3f(radiance[0], radiance[1], radiance[2]));
    // A channel that did not clip once is known.
    const int now = static_cast<int>(radiance[3]), before = static_cast<int>(-color.weight[i]);
    const int both = (now & before) != 0 ? now & before : now;
    change.new_color |= before != 0 && both != before;
    color.weight[i] = -static_cast<float>(both);
    return;
  }
  const float sum = std::max(color.weight[i], 0.0f) + weight;
  const Vector3f step = weight / sum * (Vector3f(radiance[0], radiance[1], radiance[2]) - mean);
  change.new_color |= color.weight[i] <= 0;
  change.radiance_drift += step.squaredNorm();
  mean += step;
  color.weight[i] = std::min(sum, sizes_.weight_cap);
}

BrickUpdate::Change BrickUpdate::update_open(WorkingBrick& brick, const FieldBrickMaker& maker) const {
  if (brick.open) return {};
  const Vector3f centre = T_camera_tag_ * brick_centre(brick.key, sizes_.voxel_m);
  const Vector2f pixel = map_.pixel(centre.x() / centre.z(), centre.y() / centre.z());
  const float weight = view_.block_of(static_cast<int>(pixel.x()), static_cast<int>(pixel.y())).weight;
  if (weight <= 0) return {};
  brick.prepare_change(maker);
  Change change;
  DriftSum drift;
  Readings readings{};
  readings.distance = broadcast8(kBrickSelection.open_truncations * sizes_.truncation_m);
  readings.weight = broadcast8(weight);
  readings.observed = readings.may_overrule = ~Simd8Int{};
  Simd8Int free = ~Simd8Int{};
  for (std::size_t i = 0; i < kBrickVoxels; i += kBrickEdge) {
    fuse(*brick.now, i, readings, change, drift);
    free &= load8(&brick.now->distance_m[i]) > kBrickUpdate.free * sizes_.truncation_m;
  }
  change.drift = drift.rms();
  brick.open = !any(~free);
  return change;
}

}  // namespace lumigraft::reconstruct
