#pragma once
// The vertices of a rig in a pose: morph targets, then linear blend skinning (glTF 2.0, sections 3.7.2.2 and 3.7.3.3;
// Magnenat-Thalmann et al. 1988, "Joint-Dependent Local Deformations").
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "relight/animation/rig.h"

namespace lumigraft::relight {

/// In the model's frame.
struct PosedVertices {
  std::vector<Eigen::Vector3f> positions_m;
  std::vector<Eigen::Vector3f> normals;   ///< unit; zero where the file has none
  std::vector<Eigen::Vector4f> tangents;  ///< as Model::tangents
};

/// position = Σ weight · bone · (position + Σ morph weight · target). Normals by the inverse transpose of the blended
/// matrix, up to a factor; zero where that has no rank. From the vertex `first` on.
PosedVertices skinned(const Rig& rig, const RigPose& pose, std::size_t first = 0);

/// The blended matrix of a vertex.
RigPose::Bone blended_bones(const Rig& rig, const RigPose& pose, std::size_t vertex);

}  // namespace lumigraft::relight
