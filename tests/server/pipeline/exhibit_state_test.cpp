#include "server/pipeline/exhibit_state.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace lumigraft::server {
namespace {

relight::Exhibit two_objects() {
  relight::Exhibit exhibit;
  relight::VirtualObject statue;
  statue.name = "statue";
  statue.rotation = Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitX());
  statue.motion = {{0, {0, 0, 0}, Eigen::Quaterniond::Identity()}, {1, {1, 0, 0}, Eigen::Quaterniond::Identity()}};
  auto model = std::make_shared<relight::Model>();
  model->parts.push_back({});
  model->parts[0].material.metallic = 0.75f;
  statue.model = model;
  exhibit.objects = {statue, {}};
  exhibit.objects[1].name = "box";
  return exhibit;
}

std::optional<std::string> apply(ExhibitState& board, const char* text) {
  return board.apply(std::get<ObjectCommand>(parse_command(text)));
}

TEST(ExhibitState, CommandsChangeACopy) {
  ExhibitState board(two_objects());
  const std::shared_ptr<const relight::Exhibit> before = board.newest();
  EXPECT_EQ(apply(board, R"({"type":"object","name":"box","position_m":[1,2,3],"visible":false})"), std::nullopt);
  EXPECT_TRUE(before->objects[1].visible) << "a frame in the making keeps what it has";
  EXPECT_FALSE(board.newest()->objects[1].visible);
  EXPECT_EQ(board.newest()->objects[1].position_m, Eigen::Vector3d(1, 2, 3));
  EXPECT_NE(apply(board, R"({"type":"object","name":"ghost","visible":false})"), std::nullopt);
  EXPECT_NE(apply(board, R"({"type":"object","index":2,"visible":false})"), std::nullopt);
}

TEST(ExhibitState, IsShownWhereItsFrameIs) {
  const relight::Exhibit exhibit = two_objects();
  EXPECT_EQ(shown_exhibit(exhibit, std::nullopt).objects[1].position_m, exhibit.objects[1].position_m);
  reconstruct::Pose pose;
  pose.T_tag_exhibit = Eigen::Translation3d(0.1, 0.2, 0) * Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ());
  const relight::Exhibit shown = shown_exhibit(exhibit, pose);
  for (std::size_t i = 0; i < 2; ++i)
    for (const double time_s : {0.0, 0.3, 2.0}) {  // one of them moves by its key frames
      const Eigen::Affine3d expected = pose.T_tag_exhibit * exhibit.objects[i].T_tag_model(time_s);
      EXPECT_TRUE(shown.objects[i].T_tag_model(time_s).isApprox(expected, 1e-12)) << i << " at " << time_s;
    }
}

TEST(ExhibitState, YawTurnsFromRestAboutTheTagsNormal) {
  ExhibitState board(two_objects());
  apply(board, R"({"type":"object","index":0,"yaw_degrees":50})");
  apply(board, R"({"type":"object","index":0,"yaw_degrees":90})");
  const Eigen::Quaterniond expected =
      Eigen::AngleAxisd(std::acos(0.0), Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitX());
  EXPECT_TRUE(board.newest()->objects[0].rotation.isApprox(expected, 1e-9));
  EXPECT_TRUE(board.newest()->objects[0].motion.empty()) << "taken in hand, it leaves its key frames";
  EXPECT_EQ(nlohmann::json::parse(board.objects_json())[0]["yaw_degrees"], 90.0);
}

TEST(ExhibitState, MaterialsAreLaidOverTheModelsOwn) {
  ExhibitState board(two_objects());
  apply(board, R"({"type":"object","index":0,"material":{"roughness":0.5}})");
  EXPECT_FALSE(board.newest()->objects[0].material.metallic);
  apply(board, R"({"type":"object","index":0,"material":{"specular":0.25}})");
  EXPECT_EQ(board.newest()->objects[0].material.roughness, 0.5f);
  EXPECT_EQ(nlohmann::json::parse(board.objects_json())[0]["material"]["specular"], 0.25);
  apply(board, R"({"type":"object","index":0,"material":null})");
  EXPECT_TRUE(board.newest()->objects[0].material.empty());
}

// A model of several materials keeps the properties that no viewer has set; null resets a property.
TEST(ExhibitState, WhatIsNotSetStaysTheModelsOwn) {
  ExhibitState board(two_objects());
  const auto material = [&] { return nlohmann::json::parse(board.objects_json())[0]["material"]; };
  apply(board, R"({"type":"object","index":0,"material":{"roughness":0.5}})");
  nlohmann::json expected = {{"base_color", nullptr},
                             {"metallic", nullptr},
                             {"roughness", 0.5},
                             {"specular", nullptr},
                             {"emission", nullptr},
                             {"transmission", nullptr},
                             {"ior", nullptr},
                             {"thin_walled", nullptr},
                             {"attenuation_color", nullptr},
                             {"attenuation_distance_m", nullptr}};
  EXPECT_EQ(material(), expected);
  apply(board, R"({"type":"object","index":0,"material":{"base_color":[1,0,0],"specular":0.25,"transmission":1,
                   "ior":1.25,"thin_walled":true,"attenuation_color":[1,0,0.5],"attenuation_distance_m":0.5}})");
  apply(board, R"({"type":"object","index":0,"material":{"base_color":null,"roughness":null}})");
  expected.update({{"roughness", nullptr},
                   {"specular", 0.25},
                   {"transmission", 1.0},
                   {"ior", 1.25},
                   {"thin_walled", true},
                   {"attenuation_color", {1.0, 0.0, 0.5}},
                   {"attenuation_distance_m", 0.5}});
  EXPECT_EQ(material(), expected);
}

}  // namespace
}  // namespace lumigraft::server
