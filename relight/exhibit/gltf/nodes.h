#pragma once
// The nodes of a scene and the meshes that they show.
#include <Eigen/Geometry>
#include <cstddef>
#include <map>
#include <vector>

#include "relight/animation/rig.h"
#include "relight/exhibit/gltf/json_value.h"

namespace lumigraft::relight {

/// A mesh as a node shows it.
struct GltfInstance {
  std::size_t mesh = 0;
  std::size_t node = 0;         ///< index in GltfScene::nodes
  GltfValue of;                 ///< the node
  Eigen::Affine3f T_file_mesh;  ///< without a skin
};

struct GltfScene {
  std::vector<Rig::Node> nodes;               ///< parents before children
  std::map<std::size_t, std::size_t> number;  ///< index in `nodes`, by the file's
  std::vector<GltfInstance> instances;        ///< in the order of nodes
};

/// The scene that the file shows first. Throws InputError where nodes are no trees.
GltfScene read_scene(const GltfValue& root);

}  // namespace lumigraft::relight
