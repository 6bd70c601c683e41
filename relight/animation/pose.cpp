#include "relight/animation/pose.h"

#include <algorithm>
#include <utility>

namespace lumigraft::relight {
namespace {

constexpr float kMinScale = 1e-6f;  // least scale of an object (exhibit.toml)

RigPose pose_of(const Rig& rig, const std::vector<Eigen::Affine3f>& T_parent_node, std::vector<float> morph_weights) {
  std::vector<Eigen::Affine3f> T_model_node;
  T_model_node.reserve(rig.nodes.size());
  for (std::size_t i = 0; i < rig.nodes.size(); ++i) {
    const int parent = rig.nodes[i].parent;
    const Eigen::Affine3f T_model_parent =
        parent < 0 ? Eigen::Affine3f(rig.R_model_file) : T_model_node[static_cast<std::size_t>(parent)];
    T_model_node.push_back(T_model_parent * T_parent_node[i]);
  }
  RigPose pose;
  pose.morph_weights = std::move(morph_weights);
  pose.bones.reserve(rig.bones.size());
  for (const Rig::Bone& bone : rig.bones)
    pose.bones.emplace_back((T_model_node[bone.node] * bone.T_node_mesh).affine());
  return pose;
}

std::vector<Eigen::Affine3f> at_rest(const Rig& rig) {
  std::vector<Eigen::Affine3f> T_parent_node;
  for (const Rig::Node& node : rig.nodes) T_parent_node.push_back(node.T_parent_node);
  return T_parent_node;
}

void set_at(Rig::Node& node, const Rig::Channel& channel, double time_s) {
  if (channel.moves == Rig::Moves::rotation) {
    node.rotation = channel.value.rotation_at(time_s);
    return;
  }
  const std::vector<float> value = channel.value.at(time_s);
  (channel.moves == Rig::Moves::translation ? node.translation_m : node.scale) =
      Eigen::Map<const Eigen::Vector3f>(value.data());
}

}  // namespace

bool has_extent(const RigPose& pose) {
  if (pose.at_rest()) return true;
  float largest = 0;
  for (const RigPose::Bone& bone : pose.bones) {
    if (!bone.allFinite()) return false;
    largest = std::max(largest, bone.leftCols<3>().cwiseAbs().maxCoeff());
  }
  return largest > kMinScale;
}

RigPose rest_pose(const Rig& rig) { return pose_of(rig, at_rest(rig), rig.morph_weights); }

RigPose pose_at(const Rig& rig, std::size_t animation, double time_s) {
  std::vector<Eigen::Affine3f> T_parent_node = at_rest(rig);
  std::vector<float> morph_weights = rig.morph_weights;
  std::vector<Rig::Node> moved = rig.nodes;
  for (const Rig::Channel& channel : rig.animations[animation].channels) {
    if (channel.moves == Rig::Moves::weights) {
      const std::vector<float> weights = channel.value.at(time_s);
      std::copy(weights.begin(), weights.end(), morph_weights.begin() + channel.first_weight);
      continue;
    }
    Rig::Node& node = moved[channel.node];
    set_at(node, channel, time_s);
    T_parent_node[channel.node] = Eigen::Translation3f(node.translation_m) * node.rotation * Eigen::Scaling(node.scale);
  }
  return pose_of(rig, T_parent_node, std::move(morph_weights));
}

}  // namespace lumigraft::relight
