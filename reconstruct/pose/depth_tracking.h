#pragma once
// Tracks the camera by depth against the room's surface while all tags are hidden, and returns to the tag's pose
// without a jump.
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>

#include "capture/frame.h"
#include "reconstruct/field/distance_field.h"
#include "reconstruct/math/pose_covariance.h"
#include "reconstruct/pose/depth_points.h"
#include "reconstruct/pose/icp.h"

namespace lumigraft::reconstruct {

class DepthTracking {
 public:
  explicit DepthTracking(const capture::CameraModel& camera, const capture::DepthNoise& noise = {})
      : sampler_(camera, noise) {}

  /// A tag measured this frame's pose. Returns the pose to use: after tracking, the difference between both fades out
  /// within some frames.
  Eigen::Isometry3d tag_seen(const capture::FrameSet& frame, const PoseEstimate& measured, const DistanceField* field);
  /// The smoothed pose that was displayed. Tracking starts from it, so that the image does not jump.
  void set_displayed(const Eigen::Isometry3d& T_tag_camera) { displayed_ = T_tag_camera; }
  /// Tracks the camera in a frame without a tag. Empty without depth or a pose to start from, and where the surfaces do
  /// not determine the pose.
  std::optional<PoseEstimate> track(const capture::FrameSet& frame, const DistanceField& field);
  /// Starts anew from a pose that was found without an earlier one. Returns it, aligned to the surface if a field is
  /// given: then empty if they disagree.
  std::optional<PoseEstimate> restart(const capture::FrameSet& frame, const PoseEstimate& found,
                                      const DistanceField* field);
  /// The frame's depth in the form that ICP uses. The frame must have depth.
  DepthGrid points_of(const capture::FrameSet& frame) const { return sampler_.sample(frame.depth->depth_m); }
  /// Covariance of the tag's last pose, from which tracking started.
  const PoseCovariance& covariance_at_start() const { return start_covariance_; }
  /// Covariance of a pose `elapsed_s` after its measurement, by the motion of a hand-held camera.
  static PoseCovariance predicted(const PoseCovariance& covariance, double elapsed_s);
  /// Covariance of the last pose as that of `elapsed_s` later: as predicted(), and the camera may have gone on as it
  /// moved then.
  PoseCovariance held(const PoseCovariance& covariance, double elapsed_s) const;
  void reset();

 private:
  std::optional<PoseEstimate> align(const capture::FrameSet& frame, const DistanceField& field);
  void store(const capture::FrameSet& frame, const PoseEstimate& pose);
  void remember(const capture::FrameSet& frame, const DistanceField& field);
  double elapsed_s(const capture::FrameSet& frame) const {
    return 1e-9 * static_cast<double>(frame.time_ns - time_ns_);
  }

  DepthSampler sampler_;
  std::int64_t time_ns_ = 0;
  std::optional<PoseEstimate> last_;                  ///< from the tag, or from depth while `tracking_`
  std::shared_ptr<const capture::DepthFrame> depth_;  ///< of the same frame
  std::optional<DepthGrid> grid_;                     ///< points of that depth, computed when needed
  Eigen::Matrix<double, 6, 1> velocity_ = Eigen::Matrix<double, 6, 1>::Zero();  ///< steps per second
  /// The room some time ago: a person who walks is fused from the second frame on, but is not where they were then.
  std::shared_ptr<const DistanceField> settled_, next_settled_;
  std::int64_t next_settled_ns_ = 0;
  bool tracking_ = false;
  /// The displayed pose relative to the pose from depth when tracking started: depth and print differ slightly.
  Eigen::Isometry3d handover_ = Eigen::Isometry3d::Identity();
  PoseCovariance start_covariance_ = PoseCovariance::Zero();
  Eigen::Isometry3d displayed_ = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d fading_ = Eigen::Isometry3d::Identity();  ///< difference that fades out after tracking
};

}  // namespace lumigraft::reconstruct
