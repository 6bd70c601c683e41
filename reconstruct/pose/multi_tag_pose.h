#pragma once
// One camera pose from all tags in a frame, and the poses of the extra tags in the frame of the first.
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "reconstruct/math/pose_covariance.h"
#include "reconstruct/pose/tag_pose_estimator.h"

namespace lumigraft::reconstruct {

/// Pose of an extra tag in the frame of the first: configured, or estimated from frames that show both.
class TagMapEntry {
 public:
  /// The first tag, which defines the frame until it is moved.
  TagMapEntry() : first_(true), T_world_tag_(Eigen::Isometry3d::Identity()) {}
  /// An extra tag; empty: not known yet.
  explicit TagMapEntry(const std::optional<Eigen::Isometry3d>& configured)
      : configured_(configured), T_world_tag_(configured) {}

  const std::optional<Eigen::Isometry3d>& T_world_tag() const { return T_world_tag_; }
  /// Covariance that the uncertainty of this pose adds to a camera located by the tag.
  PoseCovariance uncertainty(const Eigen::Isometry3d& T_camera_tag) const;
  /// Adds a pose measured relative to another tag in the same frame. A tag that was moved is estimated again.
  void add_sighting(const Eigen::Isometry3d& T_world_tag);
  /// A tag was moved while the room stayed.
  void move(const Eigen::Isometry3d& T_world_tag);
  /// A tag that was moved, is not located yet, or not where it is configured; else empty.
  std::string warning(int id) const;

 private:
  bool first_ = false;
  double moved_m_ = 0;
  std::optional<Eigen::Isometry3d> configured_, T_world_tag_;
  Eigen::Isometry3d mean_ = Eigen::Isometry3d::Identity();                     ///< of the sightings
  Eigen::Matrix<double, 6, 1> squares_ = Eigen::Matrix<double, 6, 1>::Zero();  ///< summed squared deviations
  int count_ = 0;                                                              ///< sightings in the mean
  int contradicting_ = 0;  ///< sightings in a row that contradict it
};

/// Whether a difference of two poses is larger than their noise (1σ) and small errors of the room explain.
bool contradicts(const Eigen::Matrix<double, 6, 1>& step, const Eigen::Matrix<double, 6, 1>& sigma);

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
/// contradicts the first, the first is right. Empty if no tag has a known pose in the world.
std::optional<MultiTagPose> pose_of_tags(const std::vector<TagReading>& readings,
                                         const std::vector<TagMapEntry>& tag_map);

}  // namespace lumigraft::reconstruct
