#pragma once
// Surface that was not there some seconds ago: of what moves.
#include <Eigen/Core>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "reconstruct/field/distance_field.h"

namespace lumigraft::reconstruct {

class NewSurface {
 public:
  /// Those of a frame's points on surface (tag frame) that are new, at most kExposure.shadows.max_moved of them. What
  /// the first frame shows is old, and surface next to old surface is noise of that.
  std::vector<Eigen::Vector3f> find(const std::vector<Eigen::Vector3f>& points_m, std::int64_t time_ns);

 private:
  struct Filled {
    std::int64_t since_ns, last_ns;
  };
  bool is_old(const Filled& space) const;
  bool is_old_around(const Eigen::Vector3i& cell) const;

  std::unordered_map<BrickKey, Filled, BrickKeyHash> filled_;  ///< space, in cells of kExposure.shadows.moved_cell_m
  std::int64_t last_frame_ns_ = -1;
  std::int64_t watched_ns_ = 0;  ///< time without gaps between frames; that of `filled_`
};

}  // namespace lumigraft::reconstruct
