#pragma once
// Where an operator said that a real surface is metal: it has no diffuse albedo, and what the camera sees on it depends
// on where the camera stands.
#include <Eigen/Core>
#include <unordered_set>
#include <vector>

#include "capture/session/session.h"
#include "reconstruct/field/distance_field.h"

namespace lumigraft::reconstruct {

class MetalMask {
 public:
  /// Reads the meshes of surfaces with metallic >= 0.5. Throws InputError.
  explicit MetalMask(const capture::Session& session);

  /// Whether metal lies within about 1.5 voxels of the point. The tag, which is paper, is not metal.
  bool contains(const Eigen::Vector3f& position_m) const;

 private:
  BrickKey cell(const Eigen::Vector3f& position_m) const;

  double tag_reach_m_;
  std::unordered_set<BrickKey, BrickKeyHash> cells_;  ///< cells of kCell_m that metal passes through
};

}  // namespace lumigraft::reconstruct
