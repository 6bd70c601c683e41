#include "reconstruct/kept_room/room_check.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>

#include "reconstruct/kept_room/parameters.h"

namespace lumigraft::reconstruct {
namespace {

constexpr const KeptRoomParameters::Check& kCheck = kKeptRoom.check;

}  // namespace

RoomCheck::Points RoomCheck::count(const DistanceField& kept, const DepthGrid& grid,
                                   const Eigen::Isometry3f& T_tag_camera) const {
  Points all, telling;
  const Eigen::Vector3f from_m = T_tag_camera.translation();
  const std::size_t step = grid.points.size() / static_cast<std::size_t>(kCheck.points) + 1;
  for (std::size_t i = 0; i < grid.points.size(); i += step) {
    const DepthGrid::Point& point = grid.points[i];
    const float z = point.position.z();
    if (!(z > 0)) continue;
    const Eigen::Vector3f seen_m = T_tag_camera * point.position;
    const auto hit = kept.raycast(from_m, (seen_m - from_m).normalized(), kCheck.near_m, kCheck.far_m);
    if (!hit) continue;
    const float away_m = std::abs(hit->normal.dot(seen_m - hit->position_m));
    const bool on_surface = away_m < kept.truncation_m + kCheck.noise_sigmas * noise_.axial_sigma_m(z);
    all.add(on_surface);
    if (std::max(std::abs(seen_m.z()), std::abs(hit->position_m.z())) > kCheck.near_plane_m) telling.add(on_surface);
  }
  return telling.all() >= kCheck.min_points ? telling : all;
}

RoomCheck::Verdict RoomCheck::look(const DistanceField& kept, const capture::Image<float>& depth_m,
                                   const Eigen::Isometry3f& T_tag_camera, std::int64_t time_ns) {
  if (looks_ > 0 && std::abs(time_ns - last_ns_) < kCheck.interval_ns) return Verdict::undecided;
  last_ns_ = time_ns;
  ++looks_;
  points_ = count(kept, sampler_.sample(depth_m), T_tag_camera);
  if (points_.all() < kCheck.min_points) return Verdict::undecided;
  ++told_;
  if (static_cast<float>(points_.on_surface) > kCheck.min_fraction * static_cast<float>(points_.all()))
    return Verdict::same;
  return ++contradictions_ >= kCheck.max_contradictions ? Verdict::another : Verdict::undecided;
}

bool RoomCheck::sees_too_little() const { return told_ == 0 && looks_ >= kCheck.max_looks; }

}  // namespace lumigraft::reconstruct
