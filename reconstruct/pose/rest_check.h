#pragma once
// Whether the camera rests while the only tag in view is carried away slowly.
#include <cstdint>
#include <memory>
#include <optional>

#include "capture/frame.h"
#include "reconstruct/field/distance_field.h"
#include "reconstruct/pose/depth_points.h"
#include "reconstruct/pose/icp.h"

namespace lumigraft::reconstruct {

/// Whether depth measured that a tag, and not the camera, moved: the pose that depth gives for the frame is about that
/// of an earlier one, and differs from the tag's by more than the noise of both. `expected`: covariance of the earlier
/// pose with the motion of a camera since. False over surfaces that do not determine the difference.
bool tag_moved_alone(const PoseEstimate& by_tag, const PoseEstimate& by_depth, const Eigen::Isometry3d& earlier,
                     const PoseCovariance& expected);

/// Whether depth fits the surface so much better at the pose by the tag than at an earlier one that the camera has
/// moved: a tag that moved alone is then out of the question. Two evaluations, in place of the alignments that
/// tag_moved_alone needs. False over surfaces that do not tell.
bool surface_shows_motion(const DepthGrid& grid, const DistanceField& field, const Eigen::Isometry3d& by_tag,
                          const Eigen::Isometry3d& earlier);

/// Compares poses over several frames: from one frame to the next a slow tag moves by less than noise.
class RestCheck {
 public:
  explicit RestCheck(const capture::CameraModel& camera, const capture::DepthNoise& noise = {})
      : sampler_(camera, noise) {}

  /// A frame with its pose by the tag. Returns the camera's pose by depth if it has rested since an earlier frame and
  /// the tag has not.
  std::optional<PoseEstimate> tag_crept(const capture::FrameSet& frame, const PoseEstimate& by_tag,
                                        const DistanceField& field);
  void reset() { earlier_.reset(); }

 private:
  DepthSampler sampler_;
  std::optional<PoseEstimate> earlier_;               ///< by the tag
  std::shared_ptr<const capture::DepthFrame> depth_;  ///< of the same frame
  std::int64_t checked_ns_ = 0;
};

}  // namespace lumigraft::reconstruct
