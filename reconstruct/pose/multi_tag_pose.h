#pragma once
// One pose from all tags in a picture.
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "reconstruct/pose/tag_map.h"
#include "reconstruct/pose/tag_pose_estimator.h"

namespace lumigraft::reconstruct {

/// What one tag says of a picture.
struct TagReading {
  std::size_t tag = 0;  ///< 0: the first, whose frame is the world
  std::vector<PoseCandidate> candidates;
  std::optional<TagCorners> corners{};  ///< empty where no square was whole
};

struct MultiTagPose {
  Eigen::Isometry3d T_tag_camera = Eigen::Isometry3d::Identity();
  PoseCovariance noise = PoseCovariance::Zero(), bias = PoseCovariance::Zero();  ///< from frame to frame; beyond it
  double position_sigma_m = 0, angle_sigma_rad = 0;                              ///< noise of T_camera_tag
  double error_px = 0;
  bool printed = true;              ///< the print was fitted, not just corners
  std::vector<std::size_t> choice;  ///< of each reading, the candidate that agrees with the pose
  std::vector<std::size_t> apart;   ///< tags that contradict it
  double rival = 0;                 ///< by how much the next best explanation is worse, in squared σ
};

/// Chooses among what explains each tag so that all agree, and takes their mean by how sure each is. The first tag is
/// right where another contradicts it. Empty where no tag has a place.
std::optional<MultiTagPose> pose_of_tags(const std::vector<TagReading>& readings,
                                         const std::vector<TagMapEntry>& places);

}  // namespace lumigraft::reconstruct
