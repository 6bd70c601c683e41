#pragma once
// The pose while the tag is hidden: carried on along the room's surface, and handed back to the tag without a jump.
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
  explicit DepthTracking(const capture::CameraModel& camera) : sampler_(camera) {}

  /// The tag gave this frame's pose. Returns the one to use: where the pose had been carried on, what that is off by
  /// fades within some frames.
  Eigen::Isometry3d seen(const capture::FrameSet& frame, const PoseEstimate& measured, const DistanceField* field);
  /// What became of it when it was smoothed: where the tag hides next, pictures go on from there.
  void shown(const Eigen::Isometry3d& T_tag_camera) { shown_ = T_tag_camera; }
  /// The tag is hidden. Empty without depth, a field, or a pose to start from, or where surfaces do not hold the pose.
  std::optional<PoseEstimate> hidden(const capture::FrameSet& frame, const DistanceField& field);
  /// Of the tag's pose when it hid, which all that follows builds on.
  const PoseCovariance& covariance_at_start() const { return start_; }
  /// How sure a pose is that long after, with nothing seen.
  static PoseCovariance after(const PoseCovariance& covariance, double passed_s);
  void reset();

 private:
  std::optional<PoseEstimate> follow(const capture::FrameSet& frame, const DistanceField& field);
  void keep(const capture::FrameSet& frame, const PoseEstimate& pose);
  double passed_s(const capture::FrameSet& frame) const { return 1e-9 * static_cast<double>(frame.time_ns - time_ns_); }

  DepthSampler sampler_;
  std::int64_t time_ns_ = 0;
  std::optional<PoseEstimate> last_;                    ///< as the tag says, or as surfaces do while `carrying_`
  std::shared_ptr<const capture::DepthPicture> depth_;  ///< of that frame
  std::optional<DepthGrid> grid_;                       ///< of that depth, once it was needed
  Eigen::Matrix<double, 6, 1> speed_ = Eigen::Matrix<double, 6, 1>::Zero();  ///< steps a second
  bool carrying_ = false;
  Eigen::Isometry3d apart_ = Eigen::Isometry3d::Identity();  ///< from the camera that surfaces saw to the tag's, then
  PoseCovariance start_ = PoseCovariance::Zero();
  Eigen::Isometry3d shown_ = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d fading_ = Eigen::Isometry3d::Identity();
};

}  // namespace lumigraft::reconstruct
