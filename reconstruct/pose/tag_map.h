#pragma once
// Pose of an extra tag in the frame of the first: configured, or estimated from frames that show both.
#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "reconstruct/math/pose_covariance.h"

namespace lumigraft::reconstruct {

class TagMapEntry {
 public:
  /// The first tag, which defines the frame.
  TagMapEntry() : first_(true), T_world_tag_(Eigen::Isometry3d::Identity()) {}
  /// An extra tag; empty: not known yet.
  explicit TagMapEntry(const std::optional<Eigen::Isometry3d>& configured)
      : configured_(configured), T_world_tag_(configured) {}

  const std::optional<Eigen::Isometry3d>& T_world_tag() const { return T_world_tag_; }
  /// Covariance that the uncertainty of this pose adds to a camera located by the tag.
  PoseCovariance uncertainty(const Eigen::Isometry3d& T_camera_tag) const;
  /// Adds a pose measured relative to another tag in the same frame. A tag that was moved is estimated again.
  void add_sighting(const Eigen::Isometry3d& T_world_tag);
  /// A tag that is not located yet, or not where it is configured; else empty.
  std::string warning(int id) const;

 private:
  bool first_ = false;
  std::optional<Eigen::Isometry3d> configured_, T_world_tag_;
  Eigen::Isometry3d mean_ = Eigen::Isometry3d::Identity();                     ///< of the sightings
  Eigen::Matrix<double, 6, 1> squares_ = Eigen::Matrix<double, 6, 1>::Zero();  ///< summed squared deviations
  int count_ = 0;                                                              ///< sightings in the mean
  int contradicting_ = 0;  ///< sightings in a row that contradict it
};

}  // namespace lumigraft::reconstruct
