#pragma once
// Depth for frames that come without it, where a depth camera is slower than the colour camera, or loses frames: that
// of the last frame that had some. Without it what is in front of objects would flicker.
#include <cstdint>
#include <memory>
#include <optional>

#include "capture/camera/camera_model.h"
#include "capture/frame.h"
#include "reconstruct/pose/pose.h"
#include "relight/compose/pixel_rays.h"

namespace lumigraft::relight {

class HeldDepth {
 public:
  explicit HeldDepth(const capture::CameraModel& camera) : camera_(camera), rays_(camera) {}

  /// Once per frame: the frame, with depth held for it if it has none. If the camera has moved since, that shows the
  /// surfaces from where it is now; 0 where they do not tell what it would show. `pose`: of this frame.
  capture::FrameSet complete(const capture::FrameSet& frame, const std::optional<reconstruct::Pose>& pose);
  /// Whether depth has stopped: none came for twice the time that it usually takes. It is still held for
  /// kCompose.fade_out_ns then, while all that is added fades out, and given up afterwards.
  bool stopped() const { return stopped_; }

 private:
  std::shared_ptr<const capture::DepthFrame> seen_from(const Eigen::Isometry3d& T_tag_camera);

  capture::CameraModel camera_;
  PixelRays rays_;
  std::shared_ptr<const capture::DepthFrame> last_, moved_;  ///< moved_: as seen from T_tag_moved_
  std::optional<Eigen::Isometry3d> T_tag_last_;
  Eigen::Isometry3d T_tag_moved_ = Eigen::Isometry3d::Identity();
  std::optional<std::int64_t> last_ns_;  ///< of frames with depth
  std::int64_t usual_ns_ = 0;            ///< between them
  bool stopped_ = false;
};

}  // namespace lumigraft::relight
