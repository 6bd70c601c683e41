#pragma once
// Compares a tag's configured size with depth: depth measures its distance, and so its size.
#include <Eigen/Geometry>
#include <string>

#include "reconstruct/pose/depth_plane.h"

namespace lumigraft::reconstruct {

class TagSizeCheck {
 public:
  TagSizeCheck(int id, double size_m) : id_(id), size_m_(size_m) {}

  /// Adds a frame: the depth plane inside the tag, and the tag's pose.
  void add(const DepthPlane& plane, const Eigen::Isometry3d& T_camera_tag);
  /// Empty if depth agrees, or has too few frames.
  std::string warning() const;

 private:
  int id_;
  double size_m_;
  int count_ = 0;
  double mean_ = 0;  ///< of the logarithm of measured depth over that of the pose
  double distance_m_ = 0;
};

}  // namespace lumigraft::reconstruct
