#include "relight/exhibit/gltf/nodes.h"

#include <string>

#include "relight/exhibit/gltf/parameters.h"

namespace lumigraft::relight {
namespace {

constexpr float kMaxRounding = 1e-5f;

Eigen::Affine3f node_transform(const GltfValue& node) {
  Eigen::Affine3f T = Eigen::Affine3f::Identity();
  const double far = kGltf.max_length;
  if (const auto matrix = node.numbers("matrix", 16, -far, far)) {
    for (Eigen::Index i = 0; i < 16; ++i)
      T.matrix()(i % 4, i / 4) = static_cast<float>((*matrix)[static_cast<std::size_t>(i)]);
    const float off = (T.matrix().row(3) - Eigen::RowVector4f(0, 0, 0, 1)).cwiseAbs().maxCoeff();
    if (off > kMaxRounding) node.member("matrix").fail("found a projection, allowed: an affine matrix");
    T.makeAffine();
    return T;
  }
  const auto vector = [](const std::vector<double>& v) -> Eigen::Vector3f {
    return Eigen::Vector3d(v[0], v[1], v[2]).cast<float>();
  };
  if (const auto translation = node.numbers("translation", 3, -far, far)) T.translate(vector(*translation));
  if (const auto q = node.numbers("rotation", 4, -far, far)) {
    const Eigen::Quaterniond rotation((*q)[3], (*q)[0], (*q)[1], (*q)[2]);
    if (!(rotation.norm() > 1e-9))
      node.member("rotation").fail("found a quaternion of length 0, allowed: one of length 1");
    T.rotate(rotation.normalized().cast<float>());
  }
  if (const auto scale = node.numbers("scale", 3, -far, far)) T.scale(vector(*scale));
  return T;
}

struct Visit {
  GltfValue reference;
  Eigen::Affine3f T_file_parent;
};

/// In reverse: the last is visited first.
void push_children(const GltfValue& children, const Eigen::Affine3f& T_file_parent, std::size_t node_count,
                   std::vector<Visit>* waiting) {
  if (children.size() > node_count) children.refuse("at most one reference to each node");
  for (std::size_t i = children.size(); i-- > 0;) waiting->push_back({children[i], T_file_parent});
}

}  // namespace

std::vector<GltfInstance> read_instances(const GltfValue& root) {
  const GltfValue scenes = root.member("scenes"), nodes = root.member("nodes");
  const std::size_t node_count = nodes.size(), mesh_count = root.member("meshes").size();
  if (scenes.size() == 0) scenes.refuse("at least one scene");
  if (node_count > kGltf.max_nodes) nodes.refuse("at most " + std::to_string(kGltf.max_nodes) + " nodes");
  const GltfValue first = root.member("scene");
  const GltfValue scene = scenes[first.exists() ? first.index(scenes.size(), "scenes") : 0];

  std::vector<GltfInstance> instances;
  std::vector<bool> visited(node_count, false);
  std::vector<Visit> waiting;
  push_children(scene.member("nodes"), Eigen::Affine3f::Identity(), node_count, &waiting);
  while (!waiting.empty()) {
    const Visit visit = waiting.back();
    waiting.pop_back();
    const std::size_t index = visit.reference.index(node_count, "nodes");
    if (visited[index]) {
      visit.reference.fail("found node " + std::to_string(index) + " a second time, allowed: trees of nodes");
    }
    visited[index] = true;
    const GltfValue node = nodes[index];
    const Eigen::Affine3f T_file_node = visit.T_file_parent * node_transform(node);
    if (const GltfValue mesh = node.member("mesh"); mesh.exists())
      instances.push_back({mesh.index(mesh_count, "meshes"), T_file_node});
    push_children(node.member("children"), T_file_node, node_count, &waiting);
  }
  return instances;
}

}  // namespace lumigraft::relight
