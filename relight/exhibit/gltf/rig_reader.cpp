#include "relight/exhibit/gltf/rig_reader.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "relight/animation/pose.h"
#include "relight/animation/skinning.h"
#include "relight/exhibit/gltf/parameters.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

constexpr float kMaxAffineRounding = 1e-5f;
constexpr float kRoundingTo8Bits = 0.5f / 255;  // of a weight

GltfValue attribute_of(const GltfValue& primitive, const std::string& name, std::size_t influence) {
  return primitive.member("attributes").member(name + std::to_string(influence / 4));
}

/// The number of a mesh's morph targets, which all of its primitives have.
std::size_t targets_of(const GltfValue& mesh) {
  const GltfValue primitives = mesh.member("primitives");
  std::size_t count = 0;
  for (std::size_t i = 0; i < primitives.size(); ++i) {
    const GltfValue targets = primitives[i].member("targets");
    if (i > 0 && targets.size() != count) {
      targets.fail("found " + std::to_string(targets.size()) + " morph targets, allowed: " + std::to_string(count) +
                   ", as of the first primitive");
    }
    count = targets.size();
  }
  return count;
}

Vector3f triple(const std::vector<float>& values, std::size_t element) {
  if (values.empty()) return Vector3f::Zero();
  return Eigen::Map<const Vector3f>(&values[3 * element]);
}

}  // namespace

GltfRig::GltfRig(const GltfDocument& document, GltfAccessors& accessors, const GltfScene& scene,
                 const Eigen::Matrix3f& up)
    : document_(document), accessors_(accessors), scene_(scene), rig_(std::make_shared<Rig>()) {
  rig_->R_model_file = up;
  rig_->nodes = scene.nodes;
  const GltfValue meshes = document.root().member("meshes");
  for (const GltfInstance& instance : scene.instances) {
    read_morphs(meshes[instance.mesh], instance);
    if (const GltfValue skin = instance.of.member("skin"); skin.exists()) read_skin(skin);
    bone_of_node_[instance.node] = add_bone(instance.node, Eigen::Affine3f::Identity());
  }
  rig_->animations = read_animations(document, accessors, scene, morphs_);
  used_ = animated() || !skins_.empty() ||
          std::ranges::any_of(rig_->morph_weights, [](float weight) { return weight != 0; });
  rest_ = rest_pose(*rig_);
}

void GltfRig::read_morphs(const GltfValue& mesh, const GltfInstance& instance) {
  const std::size_t count = targets_of(mesh);
  if (count == 0) return;
  if (rig_->morph_weights.size() + count > kGltf.max_morph_weights) {
    mesh.fail("found more than " + std::to_string(kGltf.max_morph_weights) +
              " morph targets of all nodes up to here, allowed: as many");
  }
  morphs_[instance.node] = {static_cast<std::uint32_t>(rig_->morph_weights.size()), static_cast<std::uint32_t>(count)};
  const double far = kGltf.max_length;
  auto weights = instance.of.numbers("weights", count, -far, far);
  if (!weights) weights = mesh.numbers("weights", count, -far, far);
  for (std::size_t i = 0; i < count; ++i)
    rig_->morph_weights.push_back(weights ? static_cast<float>((*weights)[i]) : 0.0f);
}

std::uint32_t GltfRig::add_bone(std::size_t node, const Eigen::Affine3f& T_node_mesh) {
  rig_->bones.push_back({static_cast<std::uint32_t>(node), T_node_mesh});
  return static_cast<std::uint32_t>(rig_->bones.size() - 1);
}

void GltfRig::read_skin(const GltfValue& reference) {
  const GltfValue skins = document_.root().member("skins");
  const std::size_t index = reference.index(skins.size(), "skins");
  if (skins_.contains(index)) return;
  const GltfValue skin = skins[index], joints = skin.member("joints"), matrices = skin.member("inverseBindMatrices");
  if (joints.size() == 0) joints.refuse("at least one joint");
  std::vector<float> inverse;
  if (matrices.exists()) {
    const GltfAccessorFormat format = accessors_.format(matrices);
    if (format.type != kGltfFloat || format.components != 16 || format.count < joints.size()) {
      matrices.fail("found " + std::to_string(format.count) + " elements of " + std::to_string(format.components) +
                    " components of " + GltfAccessors::name_of(format.type, format.normalized) +
                    ", allowed: MAT4 of FLOAT for each of the " + std::to_string(joints.size()) + " joints");
    }
    inverse = accessors_.floats(matrices);
  }
  skins_[index] = {static_cast<std::uint32_t>(rig_->bones.size()), static_cast<std::uint32_t>(joints.size())};
  const std::size_t node_count = document_.root().member("nodes").size();
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const std::size_t node = joints[j].index(node_count, "nodes");
    const auto number = scene_.number.find(node);
    if (number == scene_.number.end())
      joints[j].fail("found node " + std::to_string(node) + ", which the scene does not have, allowed: one of it");
    Eigen::Matrix4f T = Eigen::Matrix4f::Identity();
    if (!inverse.empty()) T = Eigen::Map<const Eigen::Matrix4f>(&inverse[16 * j]);
    const float off = (T.row(3) - Eigen::RowVector4f(0, 0, 0, 1)).cwiseAbs().maxCoeff();
    if (!(T.cwiseAbs().maxCoeff() <= static_cast<float>(kGltf.max_length) && off <= kMaxAffineRounding)) {
      matrices.fail("found no finite, affine matrix in element " + std::to_string(j) +
                    ", allowed: numbers at most 1e9 from 0, the last row 0 0 0 1");
    }
    add_bone(number->second, Eigen::Affine3f(T));
  }
}

void GltfRig::add_influences(const GltfInstance& instance, const GltfValue& primitive, const GltfPrimitive& read,
                             std::size_t vertex) {
  const GltfValue skin = instance.of.member("skin");
  if (!skin.exists() || read.influences == 0) {
    rig_->influences.push_back({bone_of_node_.at(instance.node), 1});
    return;
  }
  const std::size_t number = skin.index(document_.root().member("skins").size(), "skins");
  const auto& [first_bone, joints] = skins_.at(number);
  const std::size_t first = rig_->influences.size();
  float sum = 0;
  for (std::size_t i = 0; i < read.influences; ++i) {
    const float weight = read.weights[vertex * read.influences + i], joint = read.joints[vertex * read.influences + i];
    if (!(weight >= 0 && weight <= 1 + kRoundingTo8Bits)) {
      attribute_of(primitive, "WEIGHTS_", i)
          .fail("found " + std::to_string(weight) + " of vertex " + std::to_string(vertex) +
                ", allowed: weights from 0 to 1");
    }
    if (weight == 0) continue;
    if (joint >= static_cast<float>(joints)) {
      attribute_of(primitive, "JOINTS_", i)
          .fail("found joint " + std::to_string(static_cast<std::size_t>(joint)) + " of vertex " +
                std::to_string(vertex) + ", allowed: less than the " + std::to_string(joints) + " joints of skins[" +
                std::to_string(number) + "]");
    }
    rig_->influences.push_back({first_bone + static_cast<std::uint32_t>(joint), weight});
    sum += weight;
  }
  if (std::abs(sum - 1) > kRoundingTo8Bits * static_cast<float>(read.influences)) {
    attribute_of(primitive, "WEIGHTS_", 0)
        .fail("found weights of vertex " + std::to_string(vertex) + " that sum to " + std::to_string(sum) +
              ", allowed: 1, as far as 8 bits hold it");
  }
  for (std::size_t i = first; i < rig_->influences.size(); ++i) rig_->influences[i].weight /= sum;
}

void GltfRig::add_morphs(const GltfInstance& instance, const GltfPrimitive& read, std::size_t vertex) {
  const auto weights = morphs_.find(instance.node);
  if (weights == morphs_.end()) return;
  for (std::size_t t = 0; t < read.targets.size(); ++t) {
    const GltfPrimitive::Target& target = read.targets[t];
    const Rig::Morph morph{weights->second.first + static_cast<std::uint32_t>(t), triple(target.positions_m, vertex),
                           triple(target.normals, vertex), triple(target.tangents, vertex)};
    if (!(morph.position_m.isZero(0) && morph.normal.isZero(0) && morph.tangent.isZero(0)))
      rig_->morphs.push_back(morph);
  }
}

void GltfRig::end_vertex(const Rig::Vertex& vertex) {
  rig_->vertices.push_back(vertex);
  rig_->first_influence.push_back(static_cast<std::uint32_t>(rig_->influences.size()));
  rig_->first_morph.push_back(static_cast<std::uint32_t>(rig_->morphs.size()));
}

GltfRig::AtRest GltfRig::add(const GltfInstance& instance, const GltfValue& primitive, const GltfPrimitive& read) {
  const std::size_t first = rig_->vertices.size();
  for (std::size_t v = 0; v < read.vertices.size(); ++v) {
    const Corner& corner = read.vertices[v];
    add_influences(instance, primitive, read, v);
    add_morphs(instance, read, v);
    if (rig_->morphs.size() > kGltf.max_morphs) {
      primitive.fail("found more than " + std::to_string(kGltf.max_morphs) +
                     " vertices of morph targets up to here, allowed: as many");
    }
    end_vertex({corner.position_m, corner.normal, corner.tangent, corner.handedness});
  }
  AtRest out{read.vertices, false};
  const PosedVertices posed = skinned(*rig_, rest_, first);
  for (std::size_t v = 0; v < out.vertices.size(); ++v) {
    Corner& corner = out.vertices[v];
    corner.position_m = posed.positions_m[v].array() + 0.0f;  // -0 becomes 0: equal values have equal bytes
    corner.normal = posed.normals[v].array() + 0.0f;
    corner.tangent = posed.tangents[v].head<3>().array() + 0.0f;
    corner.handedness = posed.tangents[v].w();
    if (animated()) corner.source = static_cast<std::uint32_t>(first + v);
  }
  if (!out.vertices.empty()) out.mirrors = blended_bones(*rig_, rest_, first).leftCols<3>().determinant() < 0;
  if (!animated()) {
    rig_->vertices.clear();
    rig_->influences.clear();
    rig_->morphs.clear();
    rig_->first_influence = rig_->first_morph = {0};
  }
  return out;
}

void GltfRig::add_normals(std::span<Corner> corners) {
  if (!animated()) return;
  for (Corner& corner : corners) {
    const std::uint32_t source = corner.source;
    if (!rig_->vertices[source].normal.isZero(0)) continue;
    const auto [found, is_new] =
        with_normal_.try_emplace({source, {corner.normal.x(), corner.normal.y(), corner.normal.z()}},
                                 static_cast<std::uint32_t>(rig_->vertices.size()));
    corner.source = found->second;
    if (!is_new) continue;
    Rig::Vertex vertex = rig_->vertices[source];
    // Its image under the inverse transpose is the corner's normal.
    vertex.normal = (blended_bones(*rig_, rest_, source).leftCols<3>().transpose() * corner.normal).stableNormalized();
    for (std::uint32_t i = rig_->first_influence[source]; i < rig_->first_influence[source + 1]; ++i)
      rig_->influences.push_back(Rig::Influence(rig_->influences[i]));
    for (std::uint32_t i = rig_->first_morph[source]; i < rig_->first_morph[source + 1]; ++i)
      rig_->morphs.push_back(Rig::Morph(rig_->morphs[i]));
    end_vertex(vertex);
  }
}

std::shared_ptr<const Rig> GltfRig::take() { return animated() ? std::move(rig_) : nullptr; }

}  // namespace lumigraft::relight
