#pragma once
// Which method draws an exhibit on a machine without a graphics processor, where the user chose none.
//
// Cones gather what a specular object reflects per pixel and frame, which on a software device takes ten times as long
// as with matt objects. Rays on the processor are several times faster and nearer to the truth while the camera rests,
// and slower while it moves, as they compute everything per view. Matt objects cost about the same with both, and cones
// less while the camera moves.
#include <cstdint>
#include <optional>

#include "reconstruct/scene.h"
#include "relight/exhibit/exhibit.h"
#include "relight/plan.h"
#include "relight/static_view_cache.h"

namespace lumigraft::relight {

class MethodChoice {
 public:
  explicit MethodChoice(const capture::CameraModel& camera) : view_(camera) {}

  /// Whether rays are to draw: for visible specular objects while the camera rests. It counts as moving, and again as
  /// resting, when three of four frames of about a second say so; and as resting at the start.
  bool wants_rays(const Exhibit& exhibit, const std::optional<reconstruct::Pose>& pose, std::int64_t time_ns);

 private:
  bool moves(const Exhibit& exhibit, const std::optional<reconstruct::Pose>& pose, std::int64_t time_ns);

  StaticViewCache view_;
  std::optional<std::int64_t> last_ns_;
  double moved_ = 0;  ///< fraction of the last second's frames
  bool moves_ = false;
};

/// Whether any visible object has a specular part.
bool any_specular(const Exhibit& exhibit);

/// The plan of rays that takes the place of a plan of cones: live, if that is; other keys that both read are kept.
Plan by_rays(Plan cones);

}  // namespace lumigraft::relight
