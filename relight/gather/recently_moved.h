#pragma once
// Space in which something moved a moment ago. Fusion may hold surface there that is gone, while what moved hides that
// from the camera.
#include <Eigen/Geometry>
#include <cstdint>
#include <unordered_map>

#include "reconstruct/field/distance_field.h"
#include "relight/gather/moved_surfaces.h"

namespace lumigraft::relight {

class RecentlyMoved {
 public:
  /// `moved`: a frame's; `fused`: the room's pixels that they replace, in the same order.
  void add(const MovedPixels& moved, const MovedPixels& fused, std::int64_t time_ns);
  bool contains(const Eigen::Vector3f& p_m) const;         ///< or is next to it
  const Eigen::AlignedBox3f& box() const { return box_; }  ///< encloses all of it; empty: nothing moved

 private:
  std::unordered_map<reconstruct::BrickKey, std::int64_t, reconstruct::BrickKeyHash> last_ns_;  ///< by cell
  Eigen::AlignedBox3f box_;
};

}  // namespace lumigraft::relight
