#pragma once
// Where a further tag hangs in the frame of the first: as configured, or as found while both are seen.
#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "reconstruct/math/pose_covariance.h"

namespace lumigraft::reconstruct {

class TagMapEntry {
 public:
  /// The first tag: its frame is the world, for sure.
  TagMapEntry() : first_(true), T_world_tag_(Eigen::Isometry3d::Identity()) {}
  /// A further one; empty: not known yet.
  explicit TagMapEntry(const std::optional<Eigen::Isometry3d>& configured)
      : configured_(configured), T_world_tag_(configured) {}

  const std::optional<Eigen::Isometry3d>& T_world_tag() const { return T_world_tag_; }
  /// What its place leaves unsure of a camera that is located by it.
  PoseCovariance slack(const Eigen::Isometry3d& T_camera_tag) const;
  /// Where other tags in the same picture say that it hangs. One that was moved is found anew.
  void see(const Eigen::Isometry3d& T_world_tag);
  /// Empty while it is where it was configured.
  std::string warning(int id) const;

 private:
  bool first_ = false;
  std::optional<Eigen::Isometry3d> configured_, T_world_tag_;
  Eigen::Isometry3d mean_ = Eigen::Isometry3d::Identity();  ///< of what was seen
  Eigen::Matrix<double, 6, 1> squares_ = Eigen::Matrix<double, 6, 1>::Zero();
  int count_ = 0;      ///< sightings in the mean
  int elsewhere_ = 0;  ///< sightings in a row that contradict it
};

}  // namespace lumigraft::reconstruct
