#include "reconstruct/fusion/update_schedule.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "reconstruct/fusion/parameters.h"

namespace lumigraft::reconstruct {
namespace {

/// Whether what was observed before says little about what is there now.
bool outdated(const WorkingBrick& brick, double light_variance) {
  return brick.update_count < brick.active_until || brick.light_variance < light_variance;
}

/// Fraction of an update that concerns a surface, observed in the brick or known there and seen through. What is in
/// front of a surface by less than its truncation band, about another reach of the brick, may be its noise.
float surface_fraction(const VisibleBrick& visible) {
  const float offset = visible.visibility.surface_offset;
  const float seen_through = visible.brick->solid ? std::min(offset - 1, 1.0f) : 0;
  return std::max({1 - std::abs(offset), seen_through, kUpdateSchedule.min_surface_fraction});
}

/// Relative gain of information since the last update, per metre of depth: near bricks cover more of the image. What
/// was hidden lately, although it is in the image, probably still is.
float gain(const VisibleBrick& visible, std::uint32_t frame, double light_variance) {
  const WorkingBrick& brick = *visible.brick;
  const std::uint32_t updates = outdated(brick, light_variance) ? 0 : brick.update_count;
  const auto waited = static_cast<float>(frame - brick.last_update + 1);
  return surface_fraction(visible) * waited /
         (static_cast<float>(updates + 1) * static_cast<float>(brick.misses + 1) *
          std::max(visible.visibility.depth_m, kBrickSelection.near_m));
}

}  // namespace

bool update_due(const WorkingBrick& brick, std::uint32_t frame, double light_variance) {
  if (brick.update_count > 0 && brick.last_update == frame) return false;
  if (outdated(brick, light_variance)) return true;
  constexpr const auto& kSettled = kUpdateSchedule.settled_updates;
  const auto steps = std::upper_bound(kSettled.begin(), kSettled.end(), brick.update_count) - kSettled.begin();
  const std::uint32_t interval = 1u << steps;
  return frame - brick.last_update >= 1u << kSettled.size() || (frame + brick.turn) % interval == 0;
}

bool limit_work(std::vector<VisibleBrick>& bricks, std::uint32_t frame, double light_variance, std::size_t max_bricks) {
  if (bricks.size() <= max_bricks) return false;
  std::vector<std::pair<float, std::size_t>> order;  // negative gain; then the order of creation
  order.reserve(bricks.size());
  for (std::size_t i = 0; i < bricks.size(); ++i) order.emplace_back(-gain(bricks[i], frame, light_variance), i);
  const auto end = order.begin() + static_cast<std::ptrdiff_t>(max_bricks);
  std::nth_element(order.begin(), end, order.end());
  std::sort(order.begin(), end, [](const auto& a, const auto& b) { return a.second < b.second; });
  std::vector<VisibleBrick> kept;
  kept.reserve(max_bricks);
  for (auto chosen = order.begin(); chosen != end; ++chosen) kept.push_back(bricks[chosen->second]);
  bricks = std::move(kept);
  return true;
}

bool unseen(const WorkingBrick& brick, std::uint32_t frame) { return frame - brick.last_update >= kMemory.keep_frames; }

std::vector<BrickKey> least_needed(const WorkingBricks& bricks, std::size_t bytes, std::uint32_t frame, float voxel_m) {
  std::vector<std::pair<float, const WorkingBrick*>> order;  // negative need
  for (const auto& brick : bricks) {
    if (!brick->now || !unseen(*brick, frame) || brick->queued || brick->model) continue;
    const float distance_m = std::max(brick_centre(brick->key, voxel_m).norm(), kMemory.near_m);
    order.emplace_back(-static_cast<float>(frame - brick->last_update) * distance_m, brick.get());
  }
  // More are not needed.
  const std::size_t most = std::min(bytes / FieldBrickMaker::kBrick_bytes + 1, order.size());
  const auto end = order.begin() + static_cast<std::ptrdiff_t>(most);
  const auto before = [](const auto& a, const auto& b) {
    return std::tie(a.first, a.second->key) < std::tie(b.first, b.second->key);
  };
  if (end != order.end()) std::nth_element(order.begin(), end, order.end(), before);
  std::sort(order.begin(), end, before);
  std::vector<BrickKey> keys;
  std::size_t freed = 0;
  for (auto chosen = order.begin(); chosen != end && freed < bytes; ++chosen) {
    keys.push_back(chosen->second->key);
    freed += chosen->second->bytes();
  }
  return keys;
}

}  // namespace lumigraft::reconstruct
