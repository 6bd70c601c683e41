#include "reconstruct/exposure/new_surface.h"

#include <algorithm>

#include "reconstruct/exposure/parameters.h"

namespace lumigraft::reconstruct {

using Eigen::Vector3f;

bool NewSurface::is_old(const Filled& space) const {
  return space.since_ns == 0 || watched_ns_ - space.since_ns >= kExposure.shadows.moved_ns;
}

bool NewSurface::is_old_around(const Eigen::Vector3i& cell) const {
  for (int axis = 0; axis < 3; ++axis)
    for (const int step : {-1, 1}) {
      Eigen::Vector3i next = cell;
      next[axis] += step;
      const auto found = filled_.find({next.x(), next.y(), next.z()});
      if (found != filled_.end() && is_old(found->second)) return true;
    }
  return false;
}

std::vector<Vector3f> NewSurface::find(const std::vector<Vector3f>& points_m, std::int64_t time_ns) {
  if (last_frame_ns_ >= 0)
    watched_ns_ += std::clamp<std::int64_t>(time_ns - last_frame_ns_, 0, kExposure.shadows.max_gap_ns);
  last_frame_ns_ = time_ns;
  const std::int64_t now_ns = watched_ns_;
  std::vector<Vector3f> all_m;
  for (const Vector3f& p_m : points_m) {
    const Eigen::Vector3i cell = (p_m / kExposure.shadows.moved_cell_m).array().floor().cast<int>();
    Filled& space = filled_.try_emplace({cell.x(), cell.y(), cell.z()}, Filled{now_ns, now_ns}).first->second;
    if (now_ns - space.last_ns > kExposure.shadows.moved_ns) space.since_ns = now_ns;
    space.last_ns = now_ns;
    if (!is_old(space) && !is_old_around(cell)) all_m.push_back(p_m);
  }
  std::erase_if(filled_,
                [&](const auto& entry) { return now_ns - entry.second.last_ns > kExposure.shadows.forgotten_ns; });
  const std::size_t step = all_m.size() / kExposure.shadows.max_moved + 1;
  std::vector<Vector3f> some_m;
  for (std::size_t i = 0; i < all_m.size(); i += step) some_m.push_back(all_m[i]);
  return some_m;
}

}  // namespace lumigraft::reconstruct
