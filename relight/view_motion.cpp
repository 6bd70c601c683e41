#include "relight/view_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "relight/parameters.h"

namespace lumigraft::relight {

bool ViewMotion::moves(const Exhibit& exhibit, const Eigen::Isometry3d& T_tag_camera, std::int64_t time_ns) {
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const VirtualObject& object : exhibit.objects) {
    if (object.visible) nearest_m = std::min(nearest_m, (object.position_m - T_tag_camera.translation()).norm());
  }
  if (!std::isinf(nearest_m)) {
    bool moved = false;
    view_.hold(T_tag_camera, std::max(nearest_m, static_cast<double>(kRelight.min_still_m)), &moved);
    if (moved && any_) moved_ns_ = time_ns;
    any_ = true;
  }
  if (moved_ns_ && time_ns < *moved_ns_) moved_ns_ = time_ns;  // a recording that begins again
  return moved_ns_ && 1e-9 * static_cast<double>(time_ns - *moved_ns_) < kRelight.rest_s;
}

}  // namespace lumigraft::relight
