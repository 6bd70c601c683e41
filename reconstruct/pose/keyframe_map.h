#pragma once
// Where the camera is, from views of the room that were kept: without a tag, and without an earlier pose.
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/frame.h"
#include "reconstruct/math/pose_covariance.h"
#include "reconstruct/pose/icp.h"
#include "reconstruct/pose/view_features.h"

namespace lumigraft::reconstruct {

/// A view with the places of its points.
struct Keyframe {
  ViewFeatures features;                  ///< those with depth
  std::vector<Eigen::Vector3f> points_m;  ///< of each feature, camera frame
  PoseEstimate pose;
};

/// A pose by kept views.
struct LocatedView {
  PoseEstimate pose;
  PoseCovariance noise = PoseCovariance::Zero();  ///< the part of its covariance that differs from frame to frame
};

/// Keeps views that differ from each other, and finds a view among them: similar views by their small images (Klein &
/// Murray 2008), points by ORB descriptors (Rublee et al. 2011), the pose by perspective-n-point in RANSAC, then by
/// robust least squares. Surfaces without texture, and those that look alike in two places, cannot be located: the
/// result is empty if too few points agree.
class KeyframeMap {
 public:
  explicit KeyframeMap(const capture::CameraModel& color, const capture::DepthNoise& noise = {})
      : camera_(color), noise_(noise) {}

  /// Keeps the frame if no kept view is near it. It must have colour and depth on the same pixels.
  void add(const capture::FrameSet& frame, const PoseEstimate& pose);
  /// `expected`: a pose near the true one, if one is known; else all views are searched.
  std::optional<LocatedView> locate(const capture::Frame& color,
                                    const std::optional<PoseEstimate>& expected = std::nullopt);
  bool empty() const { return views_.empty(); }

  using Views = std::vector<std::shared_ptr<const Keyframe>>;
  const Views& views() const { return views_; }
  int kept() const { return kept_; }  ///< views that were added so far
  /// Goes on from views that were kept before.
  void restore(Views views);

 private:
  bool shows_nothing_new(const Eigen::Isometry3d& T_tag_camera, float distance_m) const;
  std::vector<std::size_t> candidates(const ViewFeatures& seen, const std::optional<PoseEstimate>& expected) const;

  capture::CameraModel camera_;
  capture::DepthNoise noise_;
  Views views_;
  std::vector<std::uint64_t> used_;  ///< of each view: value of located_ when it last located the camera
  std::uint64_t located_ = 0;
  int kept_ = 0;
};

}  // namespace lumigraft::reconstruct
