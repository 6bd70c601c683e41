#include "relight/animation/skinning.h"

#include <gtest/gtest.h>

#include "relight/animation/pose.h"
#include "tests/relight/animation/animated_models.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector3f;
using relight::Rig;
using relight::RigPose;

void expect_near(const Vector3f& found, const Vector3f& expected) {
  EXPECT_LT((found - expected).norm(), 1e-6f) << found.transpose() << " is not " << expected.transpose();
}

/// One vertex on one bone.
Rig single(const Rig::Vertex& vertex) {
  Rig rig;
  rig.nodes.resize(1);
  rig.bones.resize(1);
  rig.vertices = {vertex};
  rig.influences.resize(1);
  rig.first_influence = {0, 1};
  rig.first_morph = {0, 0};
  return rig;
}

RigPose bone_at(const Eigen::Affine3f& T) {
  RigPose pose;
  pose.bones.emplace_back(T.affine());
  return pose;
}

TEST(Skinning, AnArmOfTwoBonesBendsByAQuarter) {
  const Rig rig = arm({{0.5f, 0}, {1, 0.5f}, {1.5f, 1}, {2, 1}, {2, 0.5f}});
  const auto straight = skinned(rig, rest_pose(rig));
  for (std::size_t v = 0; v < 5; ++v) expect_near(straight.positions_m[v], rig.vertices[v].position_m);
  const auto bent = skinned(rig, pose_at(rig, 0, 1));
  expect_near(bent.positions_m[0], {0.5f, 0, 0});
  expect_near(bent.positions_m[1], {1, 0, 0});
  expect_near(bent.positions_m[2], {1, 0.5f, 0});
  expect_near(bent.positions_m[3], {1, 1, 0});
  expect_near(bent.positions_m[4], {1.5f, 0.5f, 0});  // the mean of (2, 0, 0) and (1, 1, 0)
  expect_near(bent.normals[0], Vector3f::UnitY());
  expect_near(bent.normals[3], -Vector3f::UnitX());
  EXPECT_TRUE(skinned(rig, pose_at(rig, 0, 0.5))
                  .positions_m[3]
                  .isApprox(Vector3f(1 + std::sqrt(0.5f), std::sqrt(0.5f), 0), 1e-5f));
}

TEST(Skinning, MorphTargetsMoveVerticesBeforeBones) {
  Rig rig = single({{1, 0, 0}, Vector3f::UnitZ(), Vector3f::UnitX(), 1});
  rig.morph_weights = {0, 0};
  rig.morphs = {{1, {0, 4, 0}, {2, 0, 0}, {0, 2, 0}}};
  rig.first_morph = {0, 1};
  RigPose pose = bone_at(Eigen::Affine3f(Eigen::Scaling(2.0f)));
  pose.morph_weights = {1, 0.5f};
  const auto posed = skinned(rig, pose);
  expect_near(posed.positions_m[0], {2, 4, 0});
  expect_near(posed.normals[0], Vector3f(1, 0, 1).normalized());
  expect_near(posed.tangents[0].head<3>(), Vector3f(1, 1, 0).normalized());
}

TEST(Skinning, NormalsFollowTheInverseTranspose) {
  const Rig rig = single({{1, 1, 0}, Vector3f(1, 1, 0).normalized(), Vector3f(1, -1, 0).normalized(), 1});
  const auto posed = skinned(rig, bone_at(Eigen::Affine3f(Eigen::Scaling(2.0f, 1.0f, 1.0f))));
  expect_near(posed.normals[0], Vector3f(0.5f, 1, 0).normalized());
  expect_near(posed.tangents[0].head<3>(), Vector3f(2, -1, 0).normalized());
  EXPECT_NEAR(posed.normals[0].dot(posed.tangents[0].head<3>()), 0, 1e-6f);
  EXPECT_EQ(posed.tangents[0].w(), 1);
}

TEST(Skinning, MirroringTurnsTheHandedness) {
  const Rig rig = single({{1, 0, 0}, Vector3f::UnitX(), Vector3f::UnitY(), 1});
  const auto posed = skinned(rig, bone_at(Eigen::Affine3f(Eigen::Scaling(-1.0f, 1.0f, 1.0f))));
  expect_near(posed.normals[0], -Vector3f::UnitX());
  expect_near(posed.tangents[0].head<3>(), Vector3f::UnitY());
  EXPECT_EQ(posed.tangents[0].w(), -1);
}

TEST(Skinning, WhatHasNoNormalOrTangentHasNone) {
  const auto posed = skinned(single({{1, 0, 0}}), bone_at(Eigen::Affine3f::Identity()));
  EXPECT_TRUE(posed.normals[0].isZero(0));
  EXPECT_TRUE(posed.tangents[0].isZero(0));
}

}  // namespace
}  // namespace lumigraft::test
