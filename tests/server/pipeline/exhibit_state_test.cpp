#include "server/pipeline/exhibit_state.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
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

TEST(ExhibitState, ViewersKnowTheBoxOfAnObject) {
  relight::Exhibit exhibit = two_objects();
  auto model = std::make_shared<relight::Model>(*exhibit.objects[0].model);
  model->positions_m = {{0, 0, 0}, {1, 2, 8}, {-1, 3, 4}};
  exhibit.objects[0].model = model;
  exhibit.objects[0].scale = 0.5;
  exhibit.objects[0].origin_m = {1, 0, 0};
  const ExhibitState board(exhibit);
  const auto objects = nlohmann::json::parse(board.objects_json());
  EXPECT_EQ(objects[0]["bounds_m"], nlohmann::json::parse("[[-1.0, 0.0, 0.0], [0.0, 1.5, 4.0]]"));
  EXPECT_EQ(objects[1]["bounds_m"], nullptr) << "it has no model yet";
}

TEST(ExhibitState, ObjectsStayWithinTheBounds) {
  const Eigen::AlignedBox3d bounds(Eigen::Vector3d(-0.5, -0.5, 0), Eigen::Vector3d(0.5, 0.5, 1));
  ExhibitState board(two_objects(), {.bounds_m = bounds, .reset_after_s = {}});
  EXPECT_EQ(apply(board, R"({"type":"object","name":"box","position_m":[0.2,-7,2]})"), std::nullopt);
  EXPECT_EQ(board.newest()->objects[1].position_m, Eigen::Vector3d(0.2, -0.5, 1));
}

TEST(ExhibitState, AnotherTakesItsPlace) {
  ExhibitState board(two_objects());
  apply(board, R"({"type":"object","name":"box","yaw_degrees":90})");
  board.at(5);
  const std::shared_ptr<const relight::Exhibit> before = board.newest();
  relight::Exhibit next;
  next.objects.resize(3);
  next.objects[2].name = "vase";
  const Eigen::AlignedBox3d bounds(Eigen::Vector3d(-1, -1, 0), Eigen::Vector3d(1, 1, 1));
  EXPECT_EQ(board.replaced(), 0u);
  board.replace(next, {.bounds_m = bounds, .reset_after_s = {}});
  EXPECT_EQ(board.replaced(), 1u);
  EXPECT_EQ(before->objects.size(), 2u) << "a frame in the making keeps what it has";
  EXPECT_EQ(board.newest()->objects.size(), 3u);
  EXPECT_NE(board.objects_json().find("vase"), std::string::npos);
  EXPECT_EQ(board.objects_json().find("90"), std::string::npos) << board.objects_json();
  EXPECT_EQ(apply(board, R"({"type":"object","name":"vase","position_m":[5,0,0]})"), std::nullopt);
  EXPECT_EQ(board.newest()->objects[2].position_m.x(), 1) << "within its own bounds";
  EXPECT_EQ(apply(board, R"({"type":"object","name":"vase","reset":true})"), std::nullopt);
  EXPECT_EQ(board.newest()->objects[2].position_m.x(), 0);
}

TEST(ExhibitState, IsAsConfiguredAgain) {
  const auto begin = ExhibitState::Clock::now();
  ExhibitState board(two_objects(), {.bounds_m = {}, .reset_after_s = 60});
  const relight::Exhibit configured = *board.newest();
  const auto later = [&](int seconds) { return begin + std::chrono::seconds(seconds); };
  const auto command = [&](const char* text, int seconds) {
    EXPECT_EQ(board.apply(std::get<ObjectCommand>(parse_command(text)), later(seconds)), std::nullopt);
  };
  EXPECT_FALSE(board.reset_if_idle(later(1000))) << "nothing was changed";
  command(R"({"type":"object","name":"statue","position_m":[1,2,3],"yaw_degrees":90,"material":{"metallic":1}})", 1000);
  command(R"({"type":"object","name":"box","visible":false})", 1030);
  EXPECT_FALSE(board.reset_if_idle(later(1089)));
  EXPECT_TRUE(board.reset_if_idle(later(1090)));
  EXPECT_FALSE(board.reset_if_idle(later(2000)));
  for (int i = 0; i < 2; ++i) {
    const relight::VirtualObject &now = board.newest()->objects[i], &then = configured.objects[i];
    EXPECT_EQ(now.position_m, then.position_m);
    EXPECT_TRUE(now.rotation.isApprox(then.rotation));
    EXPECT_EQ(now.motion.size(), then.motion.size());
    EXPECT_EQ(now.visible, then.visible);
    EXPECT_TRUE(now.material.empty());
  }
  EXPECT_EQ(nlohmann::json::parse(board.objects_json())[0]["yaw_degrees"], 0);
  command(R"({"type":"object","name":"statue","position_m":[1,2,3],"yaw_degrees":90})", 3000);
  command(R"({"type":"object","name":"statue","reset":true,"visible":false})", 3000);
  EXPECT_EQ(board.newest()->objects[0].position_m, configured.objects[0].position_m);
  EXPECT_FALSE(board.newest()->objects[0].visible) << "what else the command says counts";
}

TEST(ExhibitState, GetsModelsThatAreLoadedLater) {
  ExhibitState board(two_objects());
  board.at(5);
  const auto model = std::make_shared<const relight::Model>();
  apply(board, R"({"type":"object","name":"box","position_m":[1,2,3]})");
  board.give_model(1, [&](relight::VirtualObject& object) {
    object.model = model;
    object.animation.emplace();
  });
  const relight::VirtualObject& box = board.newest()->objects[1];
  EXPECT_EQ(box.model, model);
  EXPECT_EQ(box.position_m, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(box.animation->begin_s, 5) << "it begins when it is there";
  EXPECT_EQ(board.models_given(), 1u);
  EXPECT_THROW(board.give_model(1, [](relight::VirtualObject&) { throw std::runtime_error("no"); }),
               std::runtime_error);
  EXPECT_EQ(board.models_given(), 1u);
}

TEST(ExhibitState, IsShownWhereItsFrameIs) {
  const relight::Exhibit exhibit = two_objects();
  reconstruct::Scene scene;
  relight::Standing standing;
  EXPECT_EQ(shown_exhibit(exhibit, scene, 0, standing).objects[1].position_m, exhibit.objects[1].position_m);
  reconstruct::Pose& pose = scene.pose.emplace();
  pose.T_tag_exhibit = Eigen::Translation3d(0.1, 0.2, 0) * Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ());
  const relight::Exhibit shown = shown_exhibit(exhibit, scene, 0, standing);
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
                             {"attenuation_distance_m", nullptr},
                             {"clearcoat", nullptr},
                             {"clearcoat_roughness", nullptr}};
  EXPECT_EQ(material(), expected);
  apply(board, R"({"type":"object","index":0,"material":{"base_color":[1,0,0],"specular":0.25,"transmission":1,
                   "ior":1.25,"thin_walled":true,"attenuation_color":[1,0,0.5],"attenuation_distance_m":0.5,
                   "clearcoat":0.75,"clearcoat_roughness":0.5}})");
  apply(board, R"({"type":"object","index":0,"material":{"base_color":null,"roughness":null}})");
  expected.update({{"roughness", nullptr},
                   {"specular", 0.25},
                   {"transmission", 1.0},
                   {"ior", 1.25},
                   {"thin_walled", true},
                   {"attenuation_color", {1.0, 0.0, 0.5}},
                   {"attenuation_distance_m", 0.5},
                   {"clearcoat", 0.75},
                   {"clearcoat_roughness", 0.5}});
  EXPECT_EQ(material(), expected);
}

/// With animations of 2 s and 1 s.
relight::Exhibit animated() {
  relight::Exhibit exhibit = two_objects();
  auto model = std::make_shared<relight::Model>(*exhibit.objects[0].model);
  auto rig = std::make_shared<relight::Rig>();
  rig->animations.resize(2);
  rig->animations[0] = {"walk", 2, {}};
  rig->animations[1] = {"wave", 1, {}};
  model->rig = std::move(rig);
  exhibit.objects[0].model = std::move(model);
  exhibit.objects[0].animation.emplace();
  return exhibit;
}

class AnimatedState : public testing::Test {
 protected:
  void change(const std::string& animation) {
    EXPECT_EQ(apply(board_, (R"({"type":"object","index":0,"animation":)" + animation + "}").c_str()), std::nullopt);
  }
  /// The moment that a frame shows.
  double moment_s(double time_s) {
    const relight::ShownAnimation shown = *board_.at(time_s)->objects[0].animation;
    return shown.moment_s(shown.index == 0 ? 2 : 1, time_s);
  }
  nlohmann::json told() { return nlohmann::json::parse(board_.objects_json())[0]["animation"]; }

  ExhibitState board_{animated()};
};

TEST_F(AnimatedState, BeginsWithTheFirstFrameAndLoops) {
  EXPECT_DOUBLE_EQ(moment_s(1000), 0);
  EXPECT_DOUBLE_EQ(moment_s(1001.5), 1.5);
  EXPECT_DOUBLE_EQ(moment_s(1002.5), 0.5);
  EXPECT_EQ(told(), nlohmann::json::parse(R"({"names":["walk","wave"],"name":"walk","playing":true,"loop":true,
                                              "at_s":0.5,"length_s":2.0})"));
  EXPECT_EQ(nlohmann::json::parse(board_.objects_json())[1]["animation"], nullptr);
}

TEST_F(AnimatedState, IsStoppedAndGoesOnWhereItWas) {
  moment_s(100);
  moment_s(101.5);
  change(R"({"playing":false})");
  EXPECT_DOUBLE_EQ(moment_s(107), 1.5);
  change(R"({"playing":true})");
  EXPECT_DOUBLE_EQ(moment_s(107.25), 1.75);
  change(R"({"at_s":0.5})");
  EXPECT_DOUBLE_EQ(moment_s(107.25), 0.5);
}

TEST_F(AnimatedState, PlaysOnceAndAgainFromItsBeginning) {
  moment_s(0);
  change(R"({"loop":false})");
  EXPECT_DOUBLE_EQ(moment_s(1), 1);
  EXPECT_DOUBLE_EQ(moment_s(9), 2) << "its last pose";
  change(R"({"playing":true})");
  EXPECT_DOUBLE_EQ(moment_s(9.5), 0.5);
}

TEST_F(AnimatedState, AnotherAnimationBeginsWhereItBegins) {
  moment_s(0);
  moment_s(1.5);
  change(R"({"name":"wave"})");
  EXPECT_DOUBLE_EQ(moment_s(1.75), 0.25);
  change(R"({"name":"wave"})");
  EXPECT_DOUBLE_EQ(moment_s(2), 0.5) << "it is shown already";
}

TEST(ExhibitState, ViewersChooseAVariantOfTheMaterials) {
  relight::Exhibit exhibit = two_objects();
  relight::VirtualObject& statue = exhibit.objects[0];
  auto model = std::make_shared<relight::Model>(*statue.model);
  for (const char* name : {"red", "blue"}) model->variants.push_back({name, std::make_shared<relight::Model>()});
  statue.model = statue.default_model = model;
  ExhibitState board(exhibit);
  const auto variants = [&](std::size_t i) { return nlohmann::json::parse(board.objects_json())[i]["variants"]; };
  EXPECT_EQ(variants(0), nlohmann::json::parse(R"({"names":["red","blue"],"name":null})"));
  EXPECT_EQ(variants(1), nullptr);
  EXPECT_EQ(apply(board, R"({"type":"object","index":0,"variant":"blue"})"), std::nullopt);
  EXPECT_EQ(board.newest()->objects[0].model, model->variants[1].model);
  EXPECT_EQ(variants(0)["name"], "blue");
  EXPECT_EQ(apply(board, R"({"type":"object","index":0,"variant":"green"})"),
            "variant: found \"green\", allowed: \"red\", \"blue\"");
  EXPECT_EQ(board.newest()->objects[0].model, model->variants[1].model);
  EXPECT_EQ(apply(board, R"({"type":"object","index":0,"variant":null})"), std::nullopt);
  EXPECT_EQ(board.newest()->objects[0].model, model);
  EXPECT_NE(apply(board, R"({"type":"object","index":1,"variant":"red"})"), std::nullopt);
}

TEST_F(AnimatedState, WhatTheObjectDoesNotHaveIsRefusedAndChangesNothing) {
  const auto before = board_.newest();
  EXPECT_NE(apply(board_, R"({"type":"object","index":0,"visible":false,"animation":{"name":"fly"}})"), std::nullopt);
  EXPECT_NE(apply(board_, R"({"type":"object","index":1,"animation":{"playing":false}})"), std::nullopt);
  EXPECT_EQ(board_.newest(), before);
}

TEST(ExhibitState, WhatIsSavedIsWhereObjectsGoBackTo) {
  const std::filesystem::path file =
      std::filesystem::path(testing::TempDir()) / ("lumigraft-" + std::to_string(getpid()) + ".saved.toml");
  relight::Exhibit exhibit = two_objects();
  auto moving = std::make_shared<relight::Model>(*exhibit.objects[0].model);
  auto rig = std::make_shared<relight::Rig>();
  rig->animations.resize(1);
  rig->animations[0].name = "wave";
  rig->animations[0].length_s = 2;
  moving->rig = rig;
  exhibit.objects[0].model = moving;
  exhibit.objects[0].animation = relight::ShownAnimation{};
  ExhibitState board(exhibit, {.bounds_m = {}, .reset_after_s = {}, .saved_file = file});
  board.at(5);
  apply(board, R"({"type":"object","name":"box","position_m":[1,2,3],"yaw_degrees":90})");
  apply(board, R"({"type":"object","name":"statue","animation":{"playing":false,"at_s":0.5}})");
  const Eigen::Quaterniond turned = board.newest()->objects[1].rotation;
  board.save();
  EXPECT_TRUE(std::filesystem::exists(file));
  EXPECT_EQ(nlohmann::json::parse(board.objects_json())[1]["yaw_degrees"], 0) << "counts from what was saved";
  apply(board, R"({"type":"object","name":"box","position_m":[0,0,0],"yaw_degrees":10,"visible":false})");
  apply(board, R"({"type":"object","name":"statue","animation":{"playing":true}})");
  board.at(6);
  for (const char* name : {"box", "statue"})
    apply(board, (R"({"type":"object","reset":true,"name":")" + std::string(name) + "\"}").c_str());
  const relight::Exhibit back = *board.newest();
  EXPECT_EQ(back.objects[1].position_m, Eigen::Vector3d(1, 2, 3));
  EXPECT_TRUE(back.objects[1].visible);
  EXPECT_TRUE(back.objects[1].rotation.isApprox(turned));
  EXPECT_EQ(back.objects[0].animation->held_s, 0.5);
  EXPECT_EQ(back.objects[0].motion.size(), 2u) << "was not moved";
  std::filesystem::remove(file);

  // What cannot be written changes nothing.
  ExhibitState unwritable(exhibit, {.bounds_m = {}, .reset_after_s = {}, .saved_file = file / "below" / "a file"});
  apply(unwritable, R"({"type":"object","name":"box","position_m":[1,2,3]})");
  EXPECT_THROW(unwritable.save(), std::runtime_error);
  apply(unwritable, R"({"type":"object","name":"box","reset":true})");
  EXPECT_EQ(unwritable.newest()->objects[1].position_m, Eigen::Vector3d::Zero());
  EXPECT_THROW(ExhibitState(exhibit).save(), std::runtime_error) << "without a file";
}

}  // namespace
}  // namespace lumigraft::server
