#pragma once
// Surfaces that the session declares as metal ([[real_surface]]): they have no diffuse albedo, and their radiance
// depends on the camera position.
#include <Eigen/Core>
#include <unordered_set>

#include "capture/session/session.h"
#include "reconstruct/field/distance_field.h"

namespace lumigraft::reconstruct {

class MetalMask {
 public:
  /// Reads the meshes of real surfaces with metallic >= 0.5. Throws InputError.
  explicit MetalMask(const capture::Session& session);

  /// Whether metal is within about 1.5 voxels of the point (tag frame). The area of the tag is paper, never metal.
  bool contains(const Eigen::Vector3f& position_m) const;

 private:
  BrickKey cell(const Eigen::Vector3f& position_m) const;

  double tag_reach_m_;                                ///< half the edge of the tag's paper
  std::unordered_set<BrickKey, BrickKeyHash> cells_;  ///< cells that contain metal
};

}  // namespace lumigraft::reconstruct
