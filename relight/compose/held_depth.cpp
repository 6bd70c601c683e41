#include "relight/compose/held_depth.h"

#include <algorithm>
#include <cmath>

#include "relight/compose/parameters.h"

namespace lumigraft::relight {

capture::FrameSet HeldDepth::complete(const capture::FrameSet& frame, const std::optional<reconstruct::Pose>& pose) {
  stopped_ = false;
  const std::int64_t since_ns = last_ns_ ? frame.time_ns - *last_ns_ : 0;
  if (frame.depth) {
    // After a gap, or a step back in time (a recording that begins again), the last interval is no usual one.
    if (since_ns > 0 && since_ns <= kCompose.max_depth_interval_ns) usual_ns_ = since_ns;
    last_ = frame.depth;
    last_ns_ = frame.time_ns;
    T_tag_last_ = pose ? std::optional(pose->T_tag_camera) : std::nullopt;
    moved_.reset();
    return frame;
  }
  const std::int64_t usual_ns = std::max(kCompose.unseen_ns, 2 * usual_ns_);
  if (!last_ || since_ns < 0 || since_ns > usual_ns + kCompose.fade_out_ns) {
    last_.reset();
    return frame;
  }
  stopped_ = since_ns > usual_ns;
  capture::FrameSet completed = frame;
  if (pose && T_tag_last_) completed.depth = seen_from(pose->T_tag_camera);
  return completed;
}

std::shared_ptr<const capture::DepthFrame> HeldDepth::seen_from(const Eigen::Isometry3d& T_tag_camera) {
  if (T_tag_camera.matrix() == T_tag_last_->matrix()) return last_;
  if (moved_ && T_tag_camera.matrix() == T_tag_moved_.matrix()) return moved_;
  const Eigen::Isometry3d T_now_last = T_tag_camera.inverse() * *T_tag_last_;
  const capture::Image<float>& from = last_->depth_m;
  if (from.width != camera_.width || from.height != camera_.height) return last_;
  auto to = std::make_shared<capture::DepthFrame>();
  to->stamp = last_->stamp;
  to->depth_m = capture::Image<float>(from.width, from.height, 1);
  for (int v = 0; v < from.height; ++v) {
    for (int u = 0; u < from.width; ++u) {
      const float z_m = from.at(u, v);
      if (!(z_m > 0) || !std::isfinite(z_m)) continue;
      const Eigen::Vector3f ray = rays_.at(u, v);
      if (!(ray.z() > 0)) continue;
      const Eigen::Vector3d now_m = T_now_last * (z_m / ray.z() * ray).cast<double>();
      const auto at = now_m.z() > 0 ? camera_.project(now_m) : std::nullopt;
      if (!at || !camera_.inside(*at)) continue;
      float& nearest_m = to->depth_m.at(static_cast<int>(std::lround(at->x())), static_cast<int>(std::lround(at->y())));
      const auto seen_m = static_cast<float>(now_m.z());
      if (!(nearest_m > 0) || seen_m < nearest_m) nearest_m = seen_m;
    }
  }
  T_tag_moved_ = T_tag_camera;
  return moved_ = std::move(to);
}

}  // namespace lumigraft::relight
