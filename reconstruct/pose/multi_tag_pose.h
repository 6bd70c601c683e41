#pragma once
// One camera pose from all tags in a frame.
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "reconstruct/math/pose_covariance.h"
#include "reconstruct/pose/tag_map.h"
#include "reconstruct/pose/tag_pose_estimator.h"

namespace lumigraft::reconstruct {

/// Candidates from one tag in a frame.
struct TagReading {
  std::size_t tag = 0;  ///< index; 0: the first, whose frame is the world
  std::vector<PoseCandidate> candidates;
  std::optional<TagCorners> corners{};  ///< empty if the square was not detected
};

struct MultiTagPose {
  Eigen::Isometry3d T_tag_camera = Eigen::Isometry3d::Identity();
  PoseCovariance noise = PoseCovariance::Zero(),
                 bias = PoseCovariance::Zero();      ///< independent in each frame; constant
  double position_sigma_m = 0, angle_sigma_rad = 0;  ///< noise of T_camera_tag
  double error_px = 0;
  bool printed = true;                     ///< the print was aligned, not only corners
  std::vector<std::size_t> choice;         ///< by reading: index of the candidate that agrees with the pose
  std::vector<std::size_t> contradicting;  ///< tags
  double cost_gap = 0;                     ///< by which the next best candidate is worse, in squared σ
};

/// Chooses one candidate per tag so that all agree best, and averages them weighted by information. If another tag
/// contradicts the first, the first is right. `left_out`, by tag: those that are known to be elsewhere; empty: none.
/// Empty if no other tag has a known pose in the world.
std::optional<MultiTagPose> pose_of_tags(const std::vector<TagReading>& readings, const TagMap& tag_map,
                                         const std::vector<bool>& left_out = {});

}  // namespace lumigraft::reconstruct
