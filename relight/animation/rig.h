#pragma once
// What moves the vertices of a model: nodes, skins, morph targets and their animations (glTF 2.0, section 3.7).
#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "relight/animation/animated_value.h"

namespace lumigraft::relight {

struct Rig {
  struct Node {
    int parent = -1;  ///< of a lower number; -1: none
    /// At rest, in the parent's frame. A node with a channel has translation, rotation and scale besides.
    Eigen::Affine3f T_parent_node = Eigen::Affine3f::Identity();
    Eigen::Vector3f translation_m = Eigen::Vector3f::Zero();
    Eigen::Quaternionf rotation = Eigen::Quaternionf::Identity();
    Eigen::Vector3f scale = Eigen::Vector3f::Ones();
  };
  /// A node that vertices follow, as a joint of a skin or as the node of their mesh.
  struct Bone {
    std::uint32_t node = 0;
    Eigen::Affine3f T_node_mesh = Eigen::Affine3f::Identity();  ///< of a joint: its inverse bind matrix
  };
  struct Influence {
    std::uint32_t bone = 0;
    float weight = 1;  ///< those of a vertex sum to 1
  };
  /// What a morph target of weight 1 adds to a vertex, in the mesh's frame.
  struct Morph {
    std::uint32_t weight = 0;  ///< its index in RigPose::morph_weights
    Eigen::Vector3f position_m = Eigen::Vector3f::Zero(), normal = Eigen::Vector3f::Zero(),
                    tangent = Eigen::Vector3f::Zero();
  };
  /// In the mesh's frame, before morph targets and bones.
  struct Vertex {
    Eigen::Vector3f position_m = Eigen::Vector3f::Zero(), normal = Eigen::Vector3f::Zero();
    Eigen::Vector3f tangent = Eigen::Vector3f::Zero();  ///< zero: none
    float handedness = 0;                               ///< of the tangent, as in Model::tangents
  };

  enum class Moves { translation, rotation, scale, weights };
  struct Channel {
    Moves moves = Moves::translation;
    std::uint32_t node = 0;          ///< of all but weights
    std::uint32_t first_weight = 0;  ///< of weights: index of the first in RigPose::morph_weights
    AnimatedValue value;
  };
  struct Animation {
    std::string name;
    double length_s = 0;  ///< until its last key
    std::vector<Channel> channels;
  };

  Eigen::Matrix3f R_model_file = Eigen::Matrix3f::Identity();  ///< takes the file's up axis to z
  std::vector<Node> nodes;
  std::vector<Bone> bones;
  std::vector<float> morph_weights;  ///< at rest
  std::vector<Animation> animations;
  std::vector<Vertex> vertices;
  std::vector<Influence> influences;  ///< vertex v's are first_influence[v] to first_influence[v + 1]
  std::vector<Morph> morphs;          ///< likewise
  std::vector<std::uint32_t> first_influence = {0}, first_morph = {0};
};

/// A pose of a rig. Empty: at rest.
struct RigPose {
  using Bone = Eigen::Matrix<float, 3, 4>;
  std::vector<Bone> bones;           ///< takes the mesh's frame to the model's
  std::vector<float> morph_weights;  ///< by target of every mesh in the scene

  bool at_rest() const { return bones.empty(); }
  bool operator==(const RigPose&) const = default;
};

}  // namespace lumigraft::relight
