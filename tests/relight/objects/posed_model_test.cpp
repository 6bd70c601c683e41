#include "relight/objects/posed_model.h"

#include <gtest/gtest.h>

#include "relight/animation/pose.h"
#include "relight/objects/mesh_refine.h"
#include "relight/objects/mesh_simplify.h"
#include "tests/relight/animation/animated_models.h"
#include "tests/relight/exhibit/model_shapes.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector3f;

/// A strip along x whose end at x = 2 is on the second bone of arm().
std::shared_ptr<relight::Model> strip() {
  relight::Model model;
  add_part(&model, {{0, 0, 0}, {2, 0, 0}, {0, 1, 0}});
  auto rig = std::make_shared<relight::Rig>(arm({{0, 0}, {2, 1}, {0, 0}}));
  rig->vertices[2].position_m = {0, 1, 0};
  model.rig = std::move(rig);
  model.sources = {0, 1, 2};
  return std::make_shared<relight::Model>(std::move(model));
}

TEST(PosedModel, IsTheModelItselfAtRest) {
  const std::shared_ptr<const relight::Model> model = strip();
  EXPECT_EQ(posed_model(model, {}), model);
}

// Vertices of a subdivision are on the triangle between its posed corners, not where skinning would take them.
TEST(PosedModel, SubdividedModelsStayOnTheTrianglesOfTheModel) {
  const std::shared_ptr<const relight::Model> model = strip(), fine = relight::refine_model(*model, 0.3f);
  ASSERT_GT(fine->positions_m.size(), 20u);
  const relight::RigPose pose = pose_at(*model->rig, 0, 1);
  const auto posed = posed_model(fine, pose);
  EXPECT_LT((posed_model(model, pose)->positions_m[1] - Vector3f(1, 1, 0)).norm(), 1e-6f);
  for (std::size_t v = 0; v < fine->positions_m.size(); ++v) {
    const float u = fine->positions_m[v].x() / 2, w = fine->positions_m[v].y();  // barycentric weights
    EXPECT_LT((posed->positions_m[v] - (u * Vector3f(1, 1, 0) + w * Vector3f(0, 1, 0))).norm(), 1e-5f) << v;
  }
  EXPECT_EQ(posed->indices, fine->indices);
}

TEST(PosedModel, SimplifiedModelsMoveAlong) {
  const auto ball =
      on_a_node(model_of(sphere(1, 20)),
                {channel_of(relight::Rig::Moves::translation, 0, value_of(3, {0, 1}, {0, 0, 0, 1, 2, 3}))});
  const auto fewer = relight::refine_model(*relight::simplify_model(*ball, 300), 0.5f);
  ASSERT_LT(fewer->indices.size(), ball->indices.size());
  const auto moved = posed_model(fewer, pose_at(*ball->rig, 0, 1));
  for (std::size_t v = 0; v < fewer->positions_m.size(); ++v) {
    EXPECT_LT((moved->positions_m[v] - fewer->positions_m[v] - Vector3f(1, 2, 3)).norm(), 1e-5f);
    EXPECT_LT((moved->normals[v] - fewer->normals[v]).norm(), 1e-4f);
  }
}

TEST(PosedModel, KeepsNormalsWhereAPoseLeavesNone) {
  const auto model = strip();
  relight::RigPose flat = rest_pose(*model->rig);
  for (relight::RigPose::Bone& bone : flat.bones) bone.setZero();
  EXPECT_EQ(posed_model(model, flat)->normals, model->normals);
  flat.bones[0].setConstant(std::numeric_limits<float>::infinity());
  const auto far = posed_model(model, flat);
  for (const Vector3f& p : far->positions_m) EXPECT_TRUE(p.allFinite());
}

}  // namespace
}  // namespace lumigraft::test
