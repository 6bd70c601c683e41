#include "relight/animation/skinning.h"

#include <Eigen/Geometry>

namespace lumigraft::relight {
namespace {

/// Inverse transpose, times the determinant's absolute value.
Eigen::Matrix3f normal_matrix(const Eigen::Matrix3f& m, float determinant) {
  Eigen::Matrix3f cofactors;
  cofactors << m.col(1).cross(m.col(2)), m.col(2).cross(m.col(0)), m.col(0).cross(m.col(1));
  return determinant < 0 ? Eigen::Matrix3f(-cofactors) : cofactors;
}

Rig::Vertex morphed(const Rig& rig, const RigPose& pose, std::size_t v) {
  Rig::Vertex vertex = rig.vertices[v];
  for (std::uint32_t i = rig.first_morph[v]; i < rig.first_morph[v + 1]; ++i) {
    const Rig::Morph& morph = rig.morphs[i];
    const float weight = pose.morph_weights[morph.weight];
    vertex.position_m += weight * morph.position_m;
    vertex.normal += weight * morph.normal;
    vertex.tangent += weight * morph.tangent;
  }
  return vertex;
}

}  // namespace

RigPose::Bone blended_bones(const Rig& rig, const RigPose& pose, std::size_t vertex) {
  RigPose::Bone sum = RigPose::Bone::Zero();
  for (std::uint32_t i = rig.first_influence[vertex]; i < rig.first_influence[vertex + 1]; ++i)
    sum += rig.influences[i].weight * pose.bones[rig.influences[i].bone];
  return sum;
}

PosedVertices skinned(const Rig& rig, const RigPose& pose, std::size_t first) {
  const std::size_t count = rig.vertices.size() - first;
  PosedVertices out;
  out.positions_m.resize(count);
  out.normals.resize(count);
  out.tangents.resize(count);
  for (std::size_t v = 0; v < count; ++v) {
    const Rig::Vertex vertex = morphed(rig, pose, first + v);
    const RigPose::Bone T = blended_bones(rig, pose, first + v);
    const Eigen::Matrix3f linear = T.leftCols<3>();
    const float determinant = linear.determinant();
    out.positions_m[v] = linear * vertex.position_m + T.col(3);
    out.normals[v] = (normal_matrix(linear, determinant) * vertex.normal).stableNormalized();
    const Eigen::Vector3f tangent = (linear * vertex.tangent).stableNormalized();
    out.tangents[v] << tangent, tangent.isZero(0.0f) ? 0.0f : std::copysign(1.0f, determinant) * vertex.handedness;
  }
  return out;
}

}  // namespace lumigraft::relight
