#pragma once
// Tags that are moved while the room and other tags in view stay.
#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <vector>

#include "reconstruct/pose/icp.h"
#include "reconstruct/pose/multi_tag_pose.h"
#include "reconstruct/pose/tag_map.h"

namespace lumigraft::reconstruct {

/// Leaves them out of the pose from the first frame in which they contradict the others until they rest; then the tag
/// map has their new place.
class MovedTags {
 public:
  explicit MovedTags(std::size_t tags) : left_out_(tags), places_(tags) {}

  /// By tag; for pose_of_tags.
  const std::vector<bool>& left_out() const { return left_out_; }
  /// T_world_tag where a tag that is left out was seen last; empty for others.
  std::optional<Eigen::Isometry3d> place(std::size_t tag) const;

  /// Finds which of contradicting tags were moved: those that are elsewhere than where both were seen before, and are
  /// fewer than the others; of equally many those that contradict a camera that rests since the tags agreed, else those
  /// that contradict depth: `by_depth` is called if it decides. True if more are left out than before, and the pose is
  /// to be chosen again. If nothing decides, none is left out.
  bool find(const std::vector<TagReading>& readings, const MultiTagPose& pose, const TagMap& map,
            const std::function<std::optional<PoseEstimate>()>& by_depth);
  /// Follows those that are left out, with the frame's pose. One that rests at a new place is known there again, and
  /// one that is back where it was is used again.
  void follow(const std::vector<TagReading>& readings, const MultiTagPose& pose, TagMap& map);
  void reset();

 private:
  struct Place {
    Eigen::Isometry3d T_world_tag = Eigen::Isometry3d::Identity();
    int frames = 0;  ///< in a row that saw it here
  };
  void use_again(std::size_t tag);

  std::vector<bool> left_out_;
  std::vector<Place> places_;
  std::optional<PoseEstimate> agreed_;  ///< of the last frame in which several tags agreed
};

}  // namespace lumigraft::reconstruct
