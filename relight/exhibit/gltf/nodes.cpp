#include "relight/exhibit/gltf/nodes.h"

#include <string>

#include "relight/exhibit/gltf/parameters.h"

namespace lumigraft::relight {
namespace {

constexpr float kMaxRounding = 1e-5f;

Rig::Node read_node(const GltfValue& node) {
  Rig::Node read;
  const double far = kGltf.max_length;
  if (const auto matrix = node.numbers("matrix", 16, -far, far)) {
    Eigen::Affine3f& T = read.T_parent_node;
    for (Eigen::Index i = 0; i < 16; ++i)
      T.matrix()(i % 4, i / 4) = static_cast<float>((*matrix)[static_cast<std::size_t>(i)]);
    const float off = (T.matrix().row(3) - Eigen::RowVector4f(0, 0, 0, 1)).cwiseAbs().maxCoeff();
    if (off > kMaxRounding) node.member("matrix").fail("found a projection, allowed: an affine matrix");
    T.makeAffine();
    return read;
  }
  const auto vector = [](const std::vector<double>& v) -> Eigen::Vector3f {
    return Eigen::Vector3d(v[0], v[1], v[2]).cast<float>();
  };
  if (const auto translation = node.numbers("translation", 3, -far, far)) read.translation_m = vector(*translation);
  if (const auto q = node.numbers("rotation", 4, -far, far)) {
    const Eigen::Quaterniond rotation((*q)[3], (*q)[0], (*q)[1], (*q)[2]);
    if (!(rotation.norm() > 1e-9))
      node.member("rotation").fail("found a quaternion of length 0, allowed: one of length 1");
    read.rotation = rotation.normalized().cast<float>();
  }
  if (const auto scale = node.numbers("scale", 3, -far, far)) read.scale = vector(*scale);
  read.T_parent_node = Eigen::Translation3f(read.translation_m) * read.rotation * Eigen::Scaling(read.scale);
  return read;
}

struct Visit {
  GltfValue reference;
  int parent;  // index in the scene
  Eigen::Affine3f T_file_parent;
};

/// In reverse: the last is visited first.
void push_children(const GltfValue& children, int parent, const Eigen::Affine3f& T_file_parent, std::size_t node_count,
                   std::vector<Visit>* waiting) {
  if (children.size() > node_count) children.refuse("at most one reference to each node");
  for (std::size_t i = children.size(); i-- > 0;) waiting->push_back({children[i], parent, T_file_parent});
}

}  // namespace

GltfScene read_scene(const GltfValue& root) {
  const GltfValue scenes = root.member("scenes"), nodes = root.member("nodes");
  const std::size_t node_count = nodes.size(), mesh_count = root.member("meshes").size();
  if (scenes.size() == 0) scenes.refuse("at least one scene");
  if (node_count > kGltf.max_nodes) nodes.refuse("at most " + std::to_string(kGltf.max_nodes) + " nodes");
  const GltfValue first = root.member("scene");
  const GltfValue scene = scenes[first.exists() ? first.index(scenes.size(), "scenes") : 0];

  GltfScene found;
  std::vector<Visit> waiting;
  push_children(scene.member("nodes"), -1, Eigen::Affine3f::Identity(), node_count, &waiting);
  while (!waiting.empty()) {
    const Visit visit = waiting.back();
    waiting.pop_back();
    const std::size_t index = visit.reference.index(node_count, "nodes");
    const std::size_t number = found.nodes.size();
    if (!found.number.try_emplace(index, number).second) {
      visit.reference.fail("found node " + std::to_string(index) + " a second time, allowed: trees of nodes");
    }
    const GltfValue node = nodes[index];
    found.nodes.push_back(read_node(node));
    found.nodes.back().parent = visit.parent;
    const Eigen::Affine3f T_file_node = visit.T_file_parent * found.nodes.back().T_parent_node;
    if (const GltfValue mesh = node.member("mesh"); mesh.exists())
      found.instances.push_back({mesh.index(mesh_count, "meshes"), number, node, T_file_node});
    push_children(node.member("children"), static_cast<int>(number), T_file_node, node_count, &waiting);
  }
  return found;
}

}  // namespace lumigraft::relight
