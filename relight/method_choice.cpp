#include "relight/method_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "relight/exhibit/bsdf_params.h"
#include "relight/parameters.h"

namespace lumigraft::relight {
namespace {

bool is_specular(const VirtualObject& object) {
  return object.model && std::ranges::any_of(object.model->parts, [&](const Model::Part& part) {
           return bsdf_params_of(Eigen::Array3f::Ones(), object.material.over(part.material)).mirrors();
         });
}

}  // namespace

bool MethodChoice::wants_rays(const Exhibit& exhibit, const std::optional<reconstruct::Pose>& pose,
                              std::int64_t time_ns) {
  return !moves(exhibit, pose, time_ns) && any_specular(exhibit);
}

bool MethodChoice::moves(const Exhibit& exhibit, const std::optional<reconstruct::Pose>& pose, std::int64_t time_ns) {
  if (!pose) return moves_;
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const VirtualObject& object : exhibit.objects) {
    if (object.visible) nearest_m = std::min(nearest_m, (object.position_m - pose->T_tag_camera.translation()).norm());
  }
  if (std::isinf(nearest_m)) return moves_;
  bool moved = false;
  view_.hold(pose->T_tag_camera, std::max(nearest_m, static_cast<double>(kRelight.min_still_m)), &moved);
  const double passed_s = last_ns_ ? 1e-9 * static_cast<double>(time_ns - *last_ns_) : 0;
  last_ns_ = time_ns;
  if (passed_s <= 0) return moves_;  // the first frame, or a recording that begins again
  moved_ += (1 - std::exp(-passed_s / kRelight.motion_s)) * ((moved ? 1 : 0) - moved_);
  if (moves_ ? moved_ < 1 - kRelight.mostly : moved_ > kRelight.mostly) moves_ = !moves_;
  return moves_;
}

bool any_specular(const Exhibit& exhibit) {
  return std::ranges::any_of(exhibit.objects, [](const VirtualObject& o) { return o.visible && is_specular(o); });
}

Plan by_rays(Plan cones) {
  Plan plan = std::move(cones);
  plan.method = "rays";
  if (plan.trace_scale == 4 && !plan.user_set.contains("trace_scale")) plan.trace_scale = 8;
  return plan;
}

}  // namespace lumigraft::relight
