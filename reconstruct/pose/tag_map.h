#pragma once
// Where the room's tags are, in the frame of the first one.
#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/session/session.h"
#include "reconstruct/math/pose_covariance.h"

namespace lumigraft::reconstruct {

/// Whether a difference of two poses is larger than their noise (1σ) and small errors of the room explain.
bool contradicts(const Eigen::Matrix<double, 6, 1>& step, const Eigen::Matrix<double, 6, 1>& sigma);

/// Poses of tags from their configuration and from every pair that frames showed together. Chains of pairs locate a tag
/// that was never seen with the first one. All poses are optimized together when a pair becomes known better (pose
/// graph, as in Grisetti et al. 2010, "A tutorial on graph-based SLAM"). Tags are counted from the first, 0.
class TagMap {
 public:
  struct Tag {
    int id = 0;
    std::optional<Eigen::Isometry3d> configured;         ///< for its warning
    std::optional<Eigen::Isometry3d> held;               ///< prior: configured, or where it was when another was moved
    std::optional<Eigen::Isometry3d> T_world_tag;        ///< empty: not located
    PoseCovariance covariance = PoseCovariance::Zero();  ///< of T_world_tag: apply_step's, in the world frame
    bool seen_from_others = false;                       ///< pairs contribute to T_world_tag
    double moved_m = 0;
  };
  /// Running mean of T_a_b.
  struct Pair {
    Eigen::Isometry3d mean = Eigen::Isometry3d::Identity();
    Eigen::Matrix<double, 6, 1> squares = Eigen::Matrix<double, 6, 1>::Zero();  ///< summed squared deviations
    int count = 0;                                                              ///< sightings in the mean
    int contradicting = 0;  ///< sightings in a row that contradict it
    int optimized = 0;      ///< count at the last optimization

    bool known() const;
    Eigen::Matrix<double, 6, 1> sigma_of_one() const;
    Eigen::Matrix<double, 6, 1> sigma_of_mean() const;
  };
  /// All that was learnt; tag_map_file writes and reads it.
  struct State {
    std::vector<Tag> tags;
    std::map<std::pair<std::size_t, std::size_t>, Pair> pairs;  ///< by both tags, the smaller index first
  };

  explicit TagMap(const capture::Tag& tag);

  const State& state() const { return state_; }
  /// Goes on from what was learnt about the same tags before.
  void restore(State state) { state_ = std::move(state); }
  /// Counts the changes of the tags' poses by pairs and moves.
  std::uint64_t version() const { return version_; }

  /// Empty: not known yet.
  const std::optional<Eigen::Isometry3d>& T_world_tag(std::size_t tag) const { return state_.tags[tag].T_world_tag; }
  /// Covariance that the uncertainty of the tag's pose adds to a camera located by it.
  PoseCovariance uncertainty(std::size_t tag, const Eigen::Isometry3d& T_camera_tag) const;
  /// Adds a frame that shows both, a < b. A pair of which one tag was moved is learnt anew.
  void add_pair(std::size_t a, std::size_t b, const Eigen::Isometry3d& T_a_b);
  /// Whether a pose of b relative to a, a < b, differs from the mean of earlier frames; its own noise is not
  /// considered.
  bool contradicts_pair(std::size_t a, std::size_t b, const Eigen::Isometry3d& T_a_b) const;
  /// A tag was moved while the room and the other tags stayed.
  void move(std::size_t tag, const Eigen::Isometry3d& T_world_tag);
  /// That the tag was moved, is not located yet, or not where it is configured; else empty.
  std::string warning(std::size_t tag) const;

 private:
  void forget_pairs(std::size_t tag);
  void locate_by_chains();
  void optimize();

  bool moves_exhibit_ = false;
  State state_;
  std::uint64_t version_ = 0;
};

}  // namespace lumigraft::reconstruct
