#include "relight/animation/pose.h"

#include <gtest/gtest.h>

#include "tests/relight/animation/animated_models.h"

namespace lumigraft::test {
namespace {

using relight::Rig;
using relight::RigPose;

Eigen::Vector3f moved(const RigPose& pose, std::size_t bone, const Eigen::Vector3f& p) {
  return pose.bones[bone] * p.homogeneous();
}

TEST(Pose, ANodeThatTurnsTakesItsChildrenAlong) {
  Rig rig = arm({});
  rig.animations[0].channels[0].node = 0;
  EXPECT_TRUE(moved(rest_pose(rig), 1, {1, 0, 0}).isApprox(Eigen::Vector3f(1, 0, 0)));
  const RigPose pose = pose_at(rig, 0, 1);
  EXPECT_LT((moved(pose, 0, {1, 0, 0}) - Eigen::Vector3f(0, 1, 0)).norm(), 1e-6f);
  EXPECT_LT((moved(pose, 1, {2, 0, 0}) - Eigen::Vector3f(0, 2, 0)).norm(), 1e-6f);
}

TEST(Pose, ChannelsOfANodeAreAppliedAsScaleRotationTranslation) {
  Rig rig = arm({});
  rig.animations[0].channels.push_back(channel_of(Rig::Moves::scale, 1, value_of(3, {0}, {2, 3, 1})));
  rig.animations[0].channels.push_back(channel_of(Rig::Moves::translation, 1, value_of(3, {0, 1}, {1, 0, 0, 5, 0, 7})));
  // The point is at (1, 0, 0) of the second node: scaled to x = 2, turned to y, moved.
  EXPECT_LT((moved(pose_at(rig, 0, 1), 1, {2, 0, 0}) - Eigen::Vector3f(5, 2, 7)).norm(), 1e-6f);
}

TEST(Pose, WithoutAChannelANodeStaysAtRest) {
  Rig rig = arm({});
  rig.nodes[0].T_parent_node = Eigen::Translation3f(0, 0, 3) * Eigen::Scaling(2.0f);  // as of a matrix
  EXPECT_LT((moved(pose_at(rig, 0, 1), 1, {2, 0, 0}) - Eigen::Vector3f(2, 2, 3)).norm(), 1e-6f);
  rig.R_model_file << 1, 0, 0, 0, 0, -1, 0, 1, 0;  // y up
  EXPECT_LT((moved(pose_at(rig, 0, 1), 1, {2, 0, 0}) - Eigen::Vector3f(2, -3, 2)).norm(), 1e-6f);
}

TEST(Pose, MorphWeightsAreThoseOfTheirChannel) {
  Rig rig = arm({});
  rig.morph_weights = {0.25f, 0, 0};
  Rig::Channel weights = channel_of(Rig::Moves::weights, 0, value_of(2, {0, 1}, {0, 0, 1, 0.5f}));
  weights.first_weight = 1;
  rig.animations[0].channels.push_back(weights);
  EXPECT_EQ(pose_at(rig, 0, 0.5).morph_weights, (std::vector<float>{0.25f, 0.5f, 0.25f}));
  EXPECT_EQ(rest_pose(rig).morph_weights, rig.morph_weights);
}

TEST(Pose, IsEqualWhereNothingMoves) {
  const Rig rig = arm({});
  EXPECT_EQ(pose_at(rig, 0, 1), pose_at(rig, 0, 2)) << "after the last key";
  EXPECT_FALSE(pose_at(rig, 0, 0.5) == pose_at(rig, 0, 0.6));
}

TEST(Pose, HasNoExtentIfAllBonesShrinkToAPoint) {
  Rig rig = arm({});
  for (std::uint32_t node : {0u, 1u}) EXPECT_TRUE(has_extent(rest_pose(rig))) << node;
  rig.animations[0].channels.push_back(channel_of(Rig::Moves::scale, 1, value_of(3, {0}, {0, 0, 0})));
  EXPECT_TRUE(has_extent(pose_at(rig, 0, 0)));
  rig.animations[0].channels.push_back(channel_of(Rig::Moves::scale, 0, value_of(3, {0}, {0, 0, 0})));
  EXPECT_FALSE(has_extent(pose_at(rig, 0, 0)));
  rig.animations[0].channels.back().value.values = {1e30f, 1e30f, 1e30f};
  rig.nodes[0].T_parent_node = Eigen::Affine3f(Eigen::Scaling(1e30f));
  rig.nodes[1].T_parent_node = Eigen::Affine3f(Eigen::Scaling(1e30f));
  EXPECT_FALSE(has_extent(rest_pose(rig))) << "not finite";
}

TEST(ShownAnimation, LoopsEndsAndIsHeld) {
  relight::ShownAnimation shown;
  shown.begin_s = 10;
  EXPECT_DOUBLE_EQ(shown.moment_s(2, 10.5), 0.5);
  EXPECT_DOUBLE_EQ(shown.moment_s(2, 15), 1);
  EXPECT_DOUBLE_EQ(shown.moment_s(2, 9.5), 1.5) << "before it began it looped, too";
  EXPECT_DOUBLE_EQ(shown.moment_s(0, 12), 0) << "a single pose";
  shown.loops = false;
  EXPECT_DOUBLE_EQ(shown.moment_s(2, 15), 2);
  EXPECT_DOUBLE_EQ(shown.moment_s(2, 9), 0);
  shown.held_s = 1.25;
  EXPECT_DOUBLE_EQ(shown.moment_s(2, 15), 1.25);
}

}  // namespace
}  // namespace lumigraft::test
