#pragma once
// Skins, morph targets and animations of a glTF file, and the vertices that they move.
#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "relight/exhibit/gltf/animations.h"
#include "relight/exhibit/gltf/primitive.h"

namespace lumigraft::relight {

class GltfRig {
 public:
  /// Reads all but vertices. Keeps references. Throws InputError.
  GltfRig(const GltfDocument& document, GltfAccessors& accessors, const GltfScene& scene, const Eigen::Matrix3f& up);

  /// Whether vertices are not simply where nodes place their mesh: some are moved, skinned or morphed.
  bool used() const { return used_; }
  /// Whether anything is animated; else vertices are at rest for ever.
  bool animated() const { return !rig_->animations.empty(); }

  /// In the model's frame, at rest.
  struct AtRest {
    std::vector<Corner> vertices;  ///< numbered if anything is animated
    bool mirrors = false;          ///< as ModelBuilder::mesh_at_rest() takes it
  };
  /// Adds the vertices of a primitive of an instance. Throws InputError.
  AtRest add(const GltfInstance& instance, const GltfValue& primitive, const GltfPrimitive& read);
  /// Takes over normals that were computed where the file has none. Corners at one vertex with different normals become
  /// vertices of their own.
  void add_normals(std::span<Corner> corners);

  std::size_t vertices() const { return rig_->vertices.size(); }
  /// After the last vertex; null if nothing is animated.
  std::shared_ptr<const Rig> take();

 private:
  struct Skin {
    std::uint32_t first_bone = 0, joints = 0;
  };
  void read_morphs(const GltfValue& mesh, const GltfInstance& instance);
  void read_skin(const GltfValue& reference);
  std::uint32_t add_bone(std::size_t node, const Eigen::Affine3f& T_node_mesh);
  void add_influences(const GltfInstance& instance, const GltfValue& primitive, const GltfPrimitive& read,
                      std::size_t vertex);
  void add_morphs(const GltfInstance& instance, const GltfPrimitive& read, std::size_t vertex);
  void end_vertex(const Rig::Vertex& vertex);

  const GltfDocument& document_;
  GltfAccessors& accessors_;
  const GltfScene& scene_;
  std::shared_ptr<Rig> rig_;
  std::map<std::size_t, GltfMorphs> morphs_;           // by node of the scene
  std::map<std::size_t, Skin> skins_;                  // by the file's number
  std::map<std::size_t, std::uint32_t> bone_of_node_;  // that show a mesh without a skin, or may
  RigPose rest_;
  bool used_ = false;
  std::map<std::pair<std::uint32_t, std::array<float, 3>>, std::uint32_t> with_normal_;  // by vertex and normal
};

}  // namespace lumigraft::relight
