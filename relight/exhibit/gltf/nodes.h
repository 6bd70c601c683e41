#pragma once
// The meshes of a scene and where its nodes place them.
#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

#include "relight/exhibit/gltf/json_value.h"

namespace lumigraft::relight {

/// A mesh as a node shows it, in the file's frame.
struct GltfInstance {
  std::size_t mesh = 0;
  Eigen::Affine3f T_file_mesh;
};

/// Of the scene that the file shows first, nodes before their children. Throws InputError where nodes are no trees.
std::vector<GltfInstance> read_instances(const GltfValue& root);

}  // namespace lumigraft::relight
