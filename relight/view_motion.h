#pragma once
// Whether the camera moves or rests, as the objects show it: what rays compute for a view is kept while it rests.
#include <cstdint>
#include <optional>

#include "reconstruct/scene.h"
#include "relight/exhibit/exhibit.h"
#include "relight/static_view_cache.h"

namespace lumigraft::relight {

class ViewMotion {
 public:
  explicit ViewMotion(const capture::CameraModel& camera) : view_(camera) {}

  /// It moves from the first frame in which objects move in the image for that, until it has not for kRelight.rest_s;
  /// not at the start.
  bool moves(const Exhibit& exhibit, const Eigen::Isometry3d& T_tag_camera, std::int64_t time_ns);

 private:
  StaticViewCache view_;
  bool any_ = false;  ///< frame before
  std::optional<std::int64_t> moved_ns_;
};

}  // namespace lumigraft::relight
