#include "reconstruct/fusion_update.h"

#include <algorithm>
#include <cmath>

#include "reconstruct/four.h"
#include "reconstruct/fusion_noise.h"

namespace lumigraft {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kShellVoxels = 1.5f;  // colour, and solidity at a rim, reach this far from the surface
constexpr Four kFirst = {0, 1, 2, 3};
/// What is seen, free or a surface, so far from where it was (of the truncation distance) that noise does not explain
/// it has moved: then the past counts as so many looks. What lies hidden behind a surface denies nothing.
constexpr float kDenies = 0.75f, kDeniedLooks = 3;
/// Two sides of something thin differ by more than so much noise, and the field rises from one towards the other.
constexpr float kSideNoise = static_cast<float>(2.5 * kLeastSigmaM), kRises = 0.3f;

constexpr std::uint32_t kRowTurns = 4;  ///< looks, until it is a row's turn
constexpr float kFreeShare = 0.99f;     ///< of the truncation distance

constexpr float kDeniesNoise = static_cast<float>(4 * kLeastSigmaM);  // of a reading of weight 1

}  // namespace

/// Four voxels in the camera's frame, and the pixels they are seen at.
struct BrickUpdate::Row {
  Four x, y, z, u, v;
};

/// What the picture says about four voxels.
struct BrickUpdate::Readings {
  Four distance{}, weight{};  ///< distance may be beyond truncation
  FourInt told{};
  FourInt denies{};  ///< lanes that may say that the past is gone; beside a jump another surface may be seen
  Four facing{};     ///< 0 = no colour
  FourInt edge{};
  Four normal[3]{};  ///< of the planes measured to, of any length, away from the camera
};

BrickUpdate::BrickUpdate(const DepthView& view, const DepthPreparation& preparation, const PixelMap& map,
                         const ColourReader& colour, const Eigen::Isometry3f& T_camera_tag, const Sizes& sizes)
    : view_(view),
      map_(map),
      colour_(colour),
      T_camera_tag_(T_camera_tag),
      sizes_(sizes),
      shell_m_(kShellVoxels * sizes.voxel_m),
      denies_m_(kDenies * sizes.truncation_m),
      end_u_(static_cast<float>(2 * view.blocks_x)),
      end_v_(static_cast<float>(2 * view.blocks_y)),
      depth_(view, preparation, map, sizes.voxel_m, sizes.truncation_m, shell_m_) {}

BrickUpdate::Told BrickUpdate::update(WorkingBrick& brick, float hidden_m, Wait wait) const {
  const Vector3f corner =
      T_camera_tag_ * (sizes_.voxel_m * kBrickEdge * Eigen::Map<const Eigen::Vector3i>(brick.key.data()).cast<float>());
  const Eigen::Matrix3f step = sizes_.voxel_m * T_camera_tag_.linear();
  Told told;
  const std::uint64_t in_turns = wait == Wait::nothing ? 0
                                 : wait == Wait::free  ? brick.free_rows
                                                       : brick.free_rows | brick.silent_rows;
  for (int z = 0; z < kBrickEdge; ++z)
    for (int y = 0; y < kBrickEdge; ++y) {
      const auto at_row = static_cast<std::uint32_t>(y + kBrickEdge * z);
      const std::uint64_t bit = std::uint64_t{1} << at_row;
      if ((in_turns & bit) && (at_row + brick.turn) % kRowTurns != 0) continue;
      const Vector3f row = corner + static_cast<float>(y) * step.col(1) + static_cast<float>(z) * step.col(2);
      if (std::min(row.z(), row.z() + kBrickEdge * step(2, 0)) > hidden_m) continue;
      FourInt free = {-1, -1, -1, -1}, silent = free;
      for (int x = 0; x < kBrickEdge; x += 4) {
        const Four along = kFirst + static_cast<float>(x);
        Row at;
        at.x = row.x() + along * step(0, 0);
        at.y = row.y() + along * step(1, 0);
        at.z = row.z() + along * step(2, 0);
        const Four inverse_z = 1 / at.z;
        map_.pixels(at.x * inverse_z, at.y * inverse_z, at.u, at.v);
        const Readings readings = read(at);
        silent &= ~readings.told;
        if (!any(readings.told)) {
          free = FourInt{};
          continue;
        }
        const std::size_t i = static_cast<std::size_t>(x + kBrickEdge * (y + kBrickEdge * z));
        const Four found = fuse(brick.now, i, readings, told);
        free &= readings.told & (found > kFreeShare * sizes_.truncation_m) &
                (load(&brick.now.distance_m[i]) > kFreeShare * sizes_.truncation_m);
        if (!colour_) continue;
        const FourInt shell = (readings.facing > 0) & (size_of(found) <= shell_m_);
        if (!any(shell)) continue;
        for (int k = 0; k < 4; ++k)
          if (shell[k])
            colour(brick.now, i + static_cast<std::size_t>(k), at.u[k], at.v[k], readings.edge[k] != 0,
                   readings.facing[k]);
      }
      brick.free_rows = any(~free) ? brick.free_rows & ~bit : brick.free_rows | bit;
      brick.silent_rows = any(~silent) ? brick.silent_rows & ~bit : brick.silent_rows | bit;
    }
  ++brick.turn;
  return told;
}

[[gnu::always_inline]] inline BrickUpdate::Readings BrickUpdate::read(const Row& at) const {
  const Four u = at.u + 0.5f, v = at.v + 0.5f;
  const FourInt ahead = at.z >= kNearestM;
  const FourInt inside = ahead & (u >= 0) & (v >= 0) & (u < end_u_) & (v < end_v_);
  // Lanes that are outside read the first block.
  const FourInt block =
      (((__builtin_convertvector(v, FourInt) >> 1) * view_.blocks_x) + (__builtin_convertvector(u, FourInt) >> 1)) &
      inside;
  Four a = view_.planes[static_cast<std::size_t>(block[0])], b = view_.planes[static_cast<std::size_t>(block[1])],
       c = view_.planes[static_cast<std::size_t>(block[2])], weight = view_.planes[static_cast<std::size_t>(block[3])];
  transpose(a, b, c, weight);
  // To the plane, not along the ray, so that distances hold at grazing views too.
  const Four share_of_plane = a * at.x + b * at.y + c * at.z, plane_m = 1 / root(a * a + b * b + c * c);
  Readings readings;
  readings.distance = (1 - share_of_plane) * plane_m;
  readings.weight = weight;
  readings.normal[0] = a;
  readings.normal[1] = b;
  readings.normal[2] = c;
  readings.told = inside & (weight > 0) & (readings.distance >= -sizes_.truncation_m) &
                  (readings.distance * at.z >= -kBehindSteep * sizes_.truncation_m * plane_m * share_of_plane);
  readings.denies = readings.told;
  const FourInt shell = readings.told & (size_of(readings.distance) <= shell_m_);
  if (colour_ && any(shell))
    readings.facing =
        select(shell, plane_m * share_of_plane / root(at.x * at.x + at.y * at.y + at.z * at.z), readings.facing);
  const FourInt alone = ahead & (~inside | (weight < 0));
  if (!any(alone)) return readings;
  for (int k = 0; k < 4; ++k) {
    if (!alone[k]) continue;
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

/// Into running means. Returns the distances found, truncated.
[[gnu::always_inline]] inline Four BrickUpdate::fuse(FieldBrick& brick, std::size_t i, const Readings& readings,
                                                     Told& told) const {
  const FourInt& read = readings.told;
  told.any = true;
  const Four found = least(readings.distance, all(sizes_.truncation_m));
  const Four was = load(&brick.distance_m[i]), past = load(&brick.weight[i]);
  const FourInt unknown = read & (past <= 0);
  const FourInt moved = read & (past > 0) & (size_of(was - found) > sizes_.truncation_m);
  if (any(unknown | moved))
    for (int k = 0; k < 4; ++k) {
      told.learnt -= unknown[k];
      told.moved -= moved[k];
    }
  // Noise is measured against all of the way, however far beyond truncation it goes: the farther something is seen, the
  // more noise hides in the truncation band.
  Four share = select(read, readings.weight, Four{});
  const Four off = size_of(readings.distance - was);
  const Four noises = off * off * share;
  FourInt denied = readings.denies & (size_of(found - was) > denies_m_) & (found > -shell_m_) &
                   (noises > kDeniesNoise * kDeniesNoise);
  // What was seen from the other side of something thin, and is solid to that side as far as truncation reaches: the
  // side that is nearer tells.
  const FourInt apart = (noises > kSideNoise * kSideNoise) & (past > 0);
  const FourInt nearer = readings.denies & apart & (found > was) & (was < 0);
  const FourInt farther = apart & (found < was) & (found < 0);
  if (any(nearer | farther))
    for (std::size_t k = 0; k < 4; ++k) {
      if (!(nearer[k] | farther[k]) ||
          !from_other_side(brick, i + k, {readings.normal[0][k], readings.normal[1][k], readings.normal[2][k]}))
        continue;
      if (nearer[k])
        denied[k] = -1;
      else
        share[k] = 0, denied[k] = 0;  // says nothing at all: without weight it must not replace the past
    }
  const Four sum = select(denied, least(past, kDeniedLooks * share), past) + share;
  const Four turn = share / select(read, sum, all(1));
  store(&brick.distance_m[i], was + turn * (select(read, found, was) - was));
  store(&brick.weight[i], select(read, least(sum, all(sizes_.weight_cap)), past));
  return found;
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
void BrickUpdate::colour(FieldBrick& brick, std::size_t i, float u, float v, bool nearest, float share) const {
  Four radiance;
  if (!colour_.read(u, v, nearest, radiance)) return;
  Vector3f& mean = brick.radiance[i];
  const float sum = brick.radiance_weight[i] + share;
  mean += share / sum * (Vector3f(radiance[0], radiance[1], radiance[2]) - mean);
  brick.radiance_weight[i] = std::min(sum, sizes_.weight_cap);
}

BrickUpdate::Told BrickUpdate::clear(WorkingBrick& brick) const {
  if (brick.open) return {};
  const Vector3f centre = T_camera_tag_ * middle_of(brick.key, sizes_.voxel_m);
  const Vector2f pixel = map_.pixel(centre.x() / centre.z(), centre.y() / centre.z());
  const float share = view_.block_of(static_cast<int>(pixel.x()), static_cast<int>(pixel.y())).weight;
  if (share <= 0) return {};
  Told told;
  Readings readings;
  readings.distance = all(kOpenReach * sizes_.truncation_m);
  readings.weight = all(share);
  readings.told = readings.denies = FourInt{-1, -1, -1, -1};
  Four nearest = all(sizes_.truncation_m);
  for (std::size_t i = 0; i < kBrickVoxels; i += 4) {
    fuse(brick.now, i, readings, told);
    nearest = least(nearest, load(&brick.now.distance_m[i]));
  }
  brick.open = std::min({nearest[0], nearest[1], nearest[2], nearest[3]}) > kFreeShare * sizes_.truncation_m;
  return told;
}

}  // namespace lumigraft
