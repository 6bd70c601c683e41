#pragma once
// Whether a tag is as large as it is said to be: depth measures how far it is away, and so how large.
#include <Eigen/Geometry>
#include <string>

#include "reconstruct/pose/depth_plane.h"

namespace lumigraft::reconstruct {

class TagSizeCheck {
 public:
  TagSizeCheck(int id, double size_m) : id_(id), size_m_(size_m) {}

  /// A frame's depth across the tag beside its pose.
  void see(const DepthPlane& plane, const Eigen::Isometry3d& T_camera_tag);
  /// Empty while depth agrees, or has said too little.
  std::string warning() const;

 private:
  int id_;
  double size_m_;
  int count_ = 0;
  double mean_ = 0;  ///< of the logarithm of measured depth over the pose's
  double distance_m_ = 0;
};

}  // namespace lumigraft::reconstruct
