// Animated glTF files: what is read of them, and where their vertices are at a time.
#include <numbers>

#include "relight/animation/pose.h"
#include "relight/objects/mesh_simplify.h"
#include "relight/objects/posed_model.h"
#include "tests/relight/exhibit/gltf/animated_files.h"
#include "tests/relight/exhibit/gltf/gltf_models.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector3f;
using Corners = std::vector<Vector3f>;

std::shared_ptr<const relight::Model> at(const std::shared_ptr<const relight::Model>& model, double time_s) {
  return posed_model(model, pose_at(*model->rig, 0, time_s));
}

TEST(GltfAnimations, ANodeMoves) {
  const auto model = loaded(moving_triangle().gltf());
  ASSERT_NE(model->rig, nullptr);
  EXPECT_EQ(model->rig->animations[0].name, "translation");
  EXPECT_EQ(model->rig->animations[0].length_s, 1);
  EXPECT_TRUE(model->not_drawn.empty());
  EXPECT_TRUE(same(corners_of(*model), {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
  EXPECT_TRUE(same(corners_of(*at(model, 0.5)), {{1, 0, 0}, {2, 0, 0}, {1, 1, 0}}));
}

TEST(GltfAnimations, TheFilesUpAxisIsTurnedInEveryPose) {
  const TemporaryFolder folder;
  GltfFile file = moving_triangle();
  file.json["animations"] = {channel_animation(file, "translation", {0}, {0, 3, 0}, "VEC3")};
  const auto model = relight::load_model(folder.write("a.gltf", file.gltf()), 'y');
  EXPECT_TRUE(same(corners_of(*at(model, 0)), {{0, 0, 3}, {1, 0, 3}, {0, 0, 4}}));
}

TEST(GltfAnimations, AMirroredNodeKeepsItsFront) {
  GltfFile file = moving_triangle();
  file.json["nodes"][0]["scale"] = {1, 1, -1};
  const auto model = loaded(file.gltf());
  EXPECT_TRUE(same(corners_of(*model), {{0, 1, 0}, {1, 0, 0}, {0, 0, 0}})) << "in the other direction";
  EXPECT_TRUE(same(corners_of(*at(model, 1)), {{2, 1, 0}, {3, 0, 0}, {2, 0, 0}}));
}

TEST(GltfAnimations, ASkinReplacesTheTransformOfItsNode) {
  const auto model = loaded(skinned_triangle().gltf());
  EXPECT_TRUE(same(corners_of(*model), {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
  EXPECT_TRUE(same(corners_of(*at(model, 1)), {{0, 0, 0}, {1, 0, 1}, {0, 1, 0.5f}}));
  EXPECT_TRUE(model->not_drawn.empty());
}

TEST(GltfAnimations, MoreThanFourJointsOfAVertexCount) {
  GltfFile file = skinned_triangle();
  file.attributes()["JOINTS_1"] =
      file.add_accessor(joint_bytes(std::vector<std::uint8_t>(12, 1)), "VEC4", 5121, 3, false);
  file.attributes()["WEIGHTS_0"] = file.add({0.5f, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, "VEC4");
  file.attributes()["WEIGHTS_1"] = file.add({0, 0, 0, 0.5f, 0, 0, 0, 0, 0, 0, 0, 0}, "VEC4");
  EXPECT_TRUE(same(corners_of(*at(loaded(file.gltf()), 1)), {{0, 0, 0.5f}, {1, 0, 1}, {0, 1, 0}}));
}

TEST(GltfAnimations, WeightsOf8BitsAreMadeToSumToOne) {
  GltfFile file = skinned_triangle();
  const std::vector<std::uint8_t> weights{255, 0, 0, 0, 255, 0, 0, 0, 127, 127, 0, 0};
  file.attributes()["WEIGHTS_0"] = file.add_accessor(bytes_of(weights), "VEC4", 5121, 3, true);
  EXPECT_TRUE(same(corners_of(*at(loaded(file.gltf()), 1)), {{0, 0, 0}, {1, 0, 1}, {0, 1, 0.5f}}));
}

TEST(GltfAnimations, AMorphTargetAtHalfItsWeight) {
  const auto model = loaded(morphed_triangle().gltf());
  EXPECT_TRUE(same(corners_of(*model), {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
  EXPECT_TRUE(same(corners_of(*at(model, 0.5)), {{0, 0, 0}, {1, 0, 0.5f}, {0, 1, 0}}));
}

TEST(GltfAnimations, WithoutAnimationSkinsAndMorphsAreOnceForAll) {
  GltfFile file = skinned_triangle();
  file.json.erase("animations");
  file.json["nodes"][2]["translation"] = {1, 0, 3};
  const auto model = loaded(file.gltf());
  EXPECT_EQ(model->rig, nullptr);
  EXPECT_TRUE(model->sources.empty());
  EXPECT_TRUE(same(corners_of(*model), {{0, 0, 0}, {1, 0, 3}, {0, 1, 1.5f}}));
  GltfFile morphed = morphed_triangle();
  morphed.json.erase("animations");
  morphed.json["meshes"][0]["weights"] = {0.25};
  EXPECT_TRUE(same(corners_of(*loaded(morphed.gltf())), {{0, 0, 0}, {1, 0, 0.25f}, {0, 1, 0}}));
  morphed.json["nodes"][0]["weights"] = {0.75};
  EXPECT_TRUE(same(corners_of(*loaded(morphed.gltf())), {{0, 0, 0}, {1, 0, 0.75f}, {0, 1, 0}})) << "of the node";
}

TEST(GltfAnimations, NormalsThatAreComputedTurnWithTheirTriangle) {
  GltfFile file = moving_triangle();
  const float half = std::sqrt(0.5f), eighth = std::numbers::pi_v<float> / 8;
  file.json["nodes"][0] = {{"mesh", 0}, {"rotation", {std::sin(eighth), 0, 0, std::cos(eighth)}}, {"scale", {1, 1, 5}}};
  file.json["animations"] = {channel_animation(file, "rotation", {0}, {half, 0, 0, half}, "VEC4")};  // z to -y
  const auto model = loaded(file.gltf()), turned = at(model, 0);
  for (const Vector3f& n : model->normals) EXPECT_TRUE(n.isApprox(Vector3f(0, -half, half), 1e-5f)) << n.transpose();
  for (const Vector3f& n : turned->normals) EXPECT_TRUE(n.isApprox(-Vector3f::UnitY(), 1e-5f)) << n.transpose();
}

// An alpha mask that is opaque on the red half of the texture, x < 0.5: the cut moves with the triangle.
TEST(GltfAnimations, CutsOfAnAlphaMaskMoveAlong) {
  GltfFile file = skinned_triangle();
  capture::Image<std::uint8_t> picture(2, 1, 4);
  picture.data = {255, 0, 0, 255, 255, 0, 0, 0};
  file.json["images"] = {{{"uri", "data:image/png;base64," + to_base64(png_bytes(picture))}}};
  file.json["textures"] = {{{"source", 0}}};
  file.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}, {"alphaMode", "MASK"}}};
  file.primitive()["material"] = 0;
  const auto model = loaded(file.gltf());
  ASSERT_GT(model->indices.size(), 3u);
  // Skinning of the triangle is linear: z = x + y / 2.
  for (const auto& cut : {model, relight::simplify_model(*model, 2)}) {
    const auto shown = at(cut, 1);
    for (std::size_t v = 0; v < cut->positions_m.size(); ++v) {
      const Vector3f& p = cut->positions_m[v];
      EXPECT_LT((shown->positions_m[v] - Vector3f(p.x(), p.y(), p.x() + p.y() / 2)).norm(), 1e-5f) << p.transpose();
    }
  }
}

TEST(GltfAnimations, WhatTheSceneDoesNotShowIsLeftOut) {
  GltfFile file = moving_triangle();
  file.json["nodes"].push_back(nlohmann::json::object());
  file.json["animations"].push_back(channel_animation(file, "scale", {0, 1}, {1, 1, 1, 2, 2, 2}, "VEC3", 1));
  nlohmann::json pointer = file.json["animations"][0];
  pointer["channels"][0]["target"] = {{"path", "pointer"},
                                      {"extensions", {{"KHR_animation_pointer", {{"pointer", "/materials/0"}}}}}};
  file.json["animations"].push_back(pointer);
  file.json["animations"][0].erase("name");
  const auto model = loaded(file.gltf());
  ASSERT_EQ(model->rig->animations.size(), 1u);
  EXPECT_EQ(model->rig->animations[0].name, "animation 0");
  EXPECT_EQ(model->not_drawn, std::vector<std::string>{"KHR_animation_pointer"});
}

}  // namespace
}  // namespace lumigraft::test
