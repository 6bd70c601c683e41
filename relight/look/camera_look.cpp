#include "relight/look/camera_look.h"

#include <algorithm>
#include <cmath>

#include "relight/look/parameters.h"

namespace lumigraft::relight {

void CameraLook::follow(const std::shared_ptr<const capture::Image<std::uint8_t>>& picture,
                        const capture::CameraModel& camera, const std::optional<reconstruct::Pose>& pose,
                        const capture::Image<float>* depth_m) {
  if (!pose) return;
  noise_.take(picture, {camera, pose->T_tag_camera, depth_m});
  if (!(pose->blur_px > 0)) return;
  // Second moments add up; a pixel's area has 1/12.
  const double now = (pose->blur_px * pose->blur_px - 1) / 12;
  // Motion changes the blur from frame to frame; noise does not change it by much more than a step.
  const bool moved = std::abs(now - variance_px2_) > kLook.blur_motion_px * kLook.blur_motion_px;
  variance_px2_ = variance_px2_ < 0 || moved ? now : variance_px2_ + (now - variance_px2_) / kLook.blur_frames;
  const auto sigma = static_cast<float>(std::sqrt(std::max(variance_px2_, 0.0)));
  if (std::abs(sigma - blur_px_) > kLook.blur_step_px) blur_px_ = sigma < kLook.min_blur_px ? 0 : sigma;
}

}  // namespace lumigraft::relight
