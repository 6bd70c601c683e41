#include "reconstruct/scene_builder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

#include "capture/source.h"

namespace lumigraft::reconstruct {
namespace {

capture::Session tabletop() {
  return capture::read_session(capture::ConfigTable::load(LUMIGRAFT_SOURCE_DIR "/recordings/tabletop/session.toml"));
}

std::vector<capture::FrameSet> first_frames(const capture::Session& session, std::size_t count) {
  const std::unique_ptr<capture::FrameReader> reader = capture::open_paired_frames(session);
  std::vector<capture::FrameSet> frames;
  while (frames.size() < count) frames.push_back(reader->next(std::chrono::seconds(10)).value());
  return frames;
}

void expect_same(const Scene& a, const Scene& b) {
  ASSERT_TRUE(a.field && b.field && a.illumination && b.illumination && a.albedo && b.albedo);
  ASSERT_EQ(a.field->bricks.size(), b.field->bricks.size());
  for (const auto& [key, brick] : a.field->bricks) {
    const auto other = b.field->bricks.find(key);
    ASSERT_NE(other, b.field->bricks.end());
    ASSERT_EQ(brick->distance_m, other->second->distance_m);
  }
  ASSERT_EQ(a.illumination->lights.size(), b.illumination->lights.size());
  for (std::size_t i = 0; i < a.illumination->lights.size(); ++i) {
    EXPECT_EQ(a.illumination->lights[i].irradiance, b.illumination->lights[i].irradiance);
    EXPECT_EQ(a.illumination->lights[i].position_m, b.illumination->lights[i].position_m);
  }
  ASSERT_EQ(a.albedo->bricks.size(), b.albedo->bricks.size());
  for (const auto& [key, brick] : a.albedo->bricks) {
    const auto other = b.albedo->bricks.find(key);
    ASSERT_NE(other, b.albedo->bricks.end());
    ASSERT_EQ(brick->albedo, other->second->albedo);
  }
}

// A live pipeline calls the stages by themselves. Where none waits and nothing is dropped, the scene is that of a
// replay.
TEST(SceneBuilder, ItsStagesByThemselvesGiveTheSameScene) {
  const capture::Session session = tabletop();
  SceneBuilder at_once(session), staged(session);
  for (const capture::FrameSet& frame : first_frames(session, 10)) {
    const BuildResult built = at_once.build(frame);
    const capture::FrameSet registered = staged.register_depth(frame);
    const std::optional<Pose> pose = staged.locate_camera(registered).pose;
    staged.extract_light(frame.fisheye, frame.color.get());
    if (pose && registered.depth) staged.fuse_depth(registered, *pose);
    EXPECT_EQ(staged.solve_albedo(), built.stages.contains("albedo"));
    ASSERT_TRUE(pose && built.scene.pose);
    EXPECT_EQ(pose->T_tag_camera.matrix(), built.scene.pose->T_tag_camera.matrix());
  }
  expect_same(at_once.store().newest(), staged.store().newest());
  EXPECT_FALSE(at_once.learning());
}

capture::FrameSet with_covered_lens(const capture::FrameSet& frame) {
  capture::FrameSet covered = frame;
  auto color = std::make_shared<capture::Frame>(*frame.color);
  for (std::size_t i = 0; i < color->encoded.data.size(); ++i) color->encoded.data[i] = i % 3 == 0 ? 60 : 5;
  covered.color = color;
  return covered;
}

// Light through a finger is red. Depth, and the fish-eye's one image, are as before.
TEST(SceneBuilder, AHandOnTheColourLensChangesNeitherLightNorAlbedo) {
  const capture::Session session = tabletop();
  SceneBuilder builder(session);
  std::vector<capture::FrameSet> frames = first_frames(session, 12);
  for (std::size_t i = 1; i < frames.size(); ++i) frames[i].fisheye = frames[0].fisheye;
  Scene before;
  for (std::size_t i = 0; i < 6; ++i) before = builder.build(frames[i]).scene;
  for (std::size_t i = 6; i < 10; ++i) {
    const BuildResult built = builder.build(with_covered_lens(frames[i]));
    ASSERT_TRUE(built.scene.pose) << "depth tracks the camera";
    EXPECT_FALSE(built.frame.color_shows_room) << i;
    EXPECT_FALSE(built.stages.contains("albedo")) << i;
    EXPECT_EQ(built.scene.albedo, before.albedo) << i;
  }
  for (std::size_t i = 10; i < 12; ++i) EXPECT_TRUE(builder.build(frames[i]).frame.color_shows_room) << i;
  const Scene after = builder.store().newest();
  EXPECT_FALSE(after.illumination->dimmed);
  ASSERT_EQ(after.illumination->lights.size(), before.illumination->lights.size());
  for (const PointLight& lamp : before.illumination->lights) {
    const PointLight* now = lamp_with_id(after.illumination->lights, lamp.id);
    ASSERT_TRUE(now);
    EXPECT_NEAR(now->irradiance.sum() / lamp.irradiance.sum(), 1, 0.03);
  }
  double change = 0, all = 0;
  for (const auto& [key, brick] : before.field->bricks) {
    const FieldBrick* now = after.field->brick(key);
    if (!now) continue;
    for (std::size_t i = 0; i < kBrickVoxels; ++i) {
      if (!(brick->radiance_weight(i) > 0 && now->radiance_weight(i) > 0)) continue;
      change += static_cast<double>((now->radiance(i) - brick->radiance(i)).cwiseAbs().sum());
      all += static_cast<double>(brick->radiance(i).sum());
    }
  }
  EXPECT_LT(change, 0.05 * all);
}

TEST(SceneBuilder, MemoryOfTheFieldIsSet) {
  const capture::Session session = tabletop();
  FusionSettings small;
  small.max_memory_mb = 1;
  SceneBuilder builder(session, {}, std::make_unique<FramePace>(), small), usual(session);
  const capture::FrameSet sensed = first_frames(session, 1).front();
  for (SceneBuilder* each : {&builder, &usual}) {
    const capture::FrameSet frame = each->register_depth(sensed);
    const std::optional<Pose> pose = each->locate_camera(frame).pose;
    ASSERT_TRUE(pose);
    each->fuse_depth(frame, *pose);
  }
  EXPECT_GT(builder.fusion_memory().bricks, 0u);
  EXPECT_LE(builder.fusion_memory().used_bytes, 1'020'000u);
  EXPECT_GT(usual.fusion_memory().used_bytes, 10'000'000u);
}

TEST(SceneBuilder, LightNeedsNoColourFrame) {
  const capture::Session session = tabletop();
  const capture::FrameSet frame = first_frames(session, 1).front();
  SceneBuilder with(session), without(session);
  with.extract_light(frame.fisheye, frame.color.get());
  without.extract_light(frame.fisheye, nullptr);
  const auto seen = with.store().measured_light(), alone = without.store().measured_light();
  ASSERT_TRUE(seen && alone);
  ASSERT_FALSE(alone->lights.empty());
  EXPECT_EQ(alone->lights.front().irradiance, seen->lights.front().irradiance);
  EXPECT_EQ(alone->environment.radiance.data, seen->environment.radiance.data);
}

std::vector<std::string> light_warnings(const std::vector<std::string>& warnings) {
  std::vector<std::string> result;
  for (const std::string& warning : warnings)
    if (warning.find("fish-eye") != std::string::npos) result.push_back(warning);
  return result;
}

TEST(SceneBuilder, WithoutAFisheyeLightFollowsFromShading) {
  capture::Session session = tabletop();
  session.fisheye.reset();
  SceneBuilder builder(session);
  std::shared_ptr<const Illumination> first;
  for (capture::FrameSet frame : first_frames(session, 3)) {
    frame.fisheye.clear();
    const BuildResult built = builder.build(frame);
    ASSERT_TRUE(built.scene.illumination && built.scene.albedo);
    EXPECT_TRUE(built.scene.illumination->from_shading);
    EXPECT_FALSE(built.scene.illumination->lights.empty());
    EXPECT_EQ(light_warnings(built.warnings), std::vector<std::string>{kLightFromShading});
    if (!first) first = builder.store().measured_light();
    EXPECT_EQ(builder.store().measured_light(), first);
  }
  // A live light stage runs by itself.
  builder.extract_light({}, nullptr);
  EXPECT_EQ(builder.store().measured_light(), first);
  EXPECT_EQ(light_warnings(builder.store().newest().warnings), std::vector<std::string>{kLightFromShading});
}

TEST(SceneBuilder, AFisheyeIsAwaitedAndReplacesTheEstimate) {
  const capture::Session session = tabletop();
  const capture::FrameSet sensed = first_frames(session, 1).front();
  SceneBuilder builder(session);
  const auto build = [&](double time_s, bool with_fisheye) {
    capture::FrameSet frame = sensed;
    frame.time_ns += static_cast<std::int64_t>(1e9 * time_s);
    if (!with_fisheye) frame.fisheye.clear();
    return builder.build(frame).scene.illumination;
  };
  EXPECT_FALSE(build(0, false));
  EXPECT_FALSE(build(0.4, false));
  const auto estimated = build(0.6, false);
  ASSERT_TRUE(estimated);
  EXPECT_TRUE(estimated->from_shading);
  const auto measured = build(0.7, true);
  EXPECT_FALSE(measured->from_shading);
  EXPECT_FALSE(build(0.8, false)->from_shading);
}

/// The lamps of the frame's fish-eye image are behind something as bright as the room at most.
capture::FrameSet without_lamps(capture::FrameSet frame) {
  constexpr float kRoom = 0.1f;  // W/sr/m²; lamps are 80 to 900 times as bright
  for (std::shared_ptr<const capture::Frame>& fisheye : frame.fisheye) {
    auto hidden = std::make_shared<capture::Frame>(*fisheye);
    for (float& radiance : hidden->radiance.data) radiance = std::min(radiance, kRoom);
    fisheye = hidden;
  }
  return frame;
}

TEST(SceneBuilder, LampsHiddenFromTheFisheyeFollowFromShading) {
  const capture::Session session = tabletop();
  SceneBuilder builder(session);
  const std::vector<capture::FrameSet> frames = first_frames(session, 4);
  for (std::size_t i = 0; i < 3; ++i) {
    const BuildResult built = builder.build(without_lamps(frames[i]));
    ASSERT_TRUE(built.scene.illumination);
    EXPECT_TRUE(built.scene.illumination->from_shading) << i;
    EXPECT_FALSE(built.scene.illumination->lights.empty()) << i;
    EXPECT_EQ(light_warnings(built.warnings), std::vector<std::string>{kLightIsHidden}) << i;
  }
  const BuildResult built = builder.build(frames[3]);
  EXPECT_FALSE(built.scene.illumination->from_shading) << "the fish-eye sees the lamps again";
  EXPECT_EQ(light_warnings(built.warnings), std::vector<std::string>{});
}

std::vector<std::string> warnings_of(const std::vector<std::string>& warnings, const std::string& about) {
  std::vector<std::string> result;
  for (const std::string& warning : warnings)
    if (warning.starts_with(about)) result.push_back(warning);
  return result;
}

/// `sensed` after `time_s`.
capture::FrameSet later(capture::FrameSet sensed, double time_s, bool with_depth) {
  sensed.time_ns += static_cast<std::int64_t>(1e9 * time_s);
  if (!with_depth) sensed.raw_depth = nullptr;
  return sensed;
}

/// Distance of the field from the measured surface at points of the table next to the tag, mean of magnitudes.
double table_error_m(const DistanceField& field) {
  double sum = 0;
  int count = 0;
  for (float x = -0.2f; x < 0.21f; x += 0.05f)
    for (float y = -0.2f; y < 0.01f; y += 0.05f, ++count) {
      const auto sample = field.sample({x, y, 0});
      sum += sample ? std::abs(static_cast<double>(sample->distance_m)) : 1;
    }
  return sum / count;
}

TEST(SceneBuilder, WithoutADepthCameraTheTagsPlaneIsTheRoom) {
  capture::Session session = tabletop();
  session.depth.reset();
  SceneBuilder builder(session);
  for (const capture::FrameSet& frame : first_frames(session, 3)) {
    const BuildResult built = builder.build(frame);
    ASSERT_TRUE(built.scene.field && built.scene.albedo && built.frame.depth);
    EXPECT_LT(table_error_m(*built.scene.field), 0.001);
    EXPECT_EQ(warnings_of(built.warnings, "no depth").size(), 1u);
  }
}

TEST(SceneBuilder, DepthIsAwaitedAndReplacesThePlane) {
  const capture::Session session = tabletop();
  const capture::FrameSet sensed = first_frames(session, 1).front();
  SceneBuilder builder(session);
  EXPECT_FALSE(builder.build(later(sensed, 0, false)).scene.field);
  EXPECT_FALSE(builder.build(later(sensed, 0.4, false)).scene.field);
  const BuildResult assumed = builder.build(later(sensed, 0.6, false));
  ASSERT_TRUE(assumed.scene.field);
  EXPECT_EQ(warnings_of(assumed.warnings, "no depth").size(), 1u);
  const BuildResult measured = builder.build(later(sensed, 0.7, true));
  EXPECT_TRUE(warnings_of(measured.warnings, "no depth").empty());
  EXPECT_GT(measured.scene.field->bricks.size(), 2 * assumed.scene.field->bricks.size()) << "boxes and walls";

  // Where depth ends, what it showed stays.
  const BuildResult ended = builder.build(later(sensed, 9, false));
  EXPECT_FALSE(ended.frame.depth);
  EXPECT_EQ(ended.scene.field->bricks.size(), measured.scene.field->bricks.size());
}

TEST(SceneBuilder, WithoutATagAWarningNamesIt) {
  for (const bool with_depth : {true, false}) {
    capture::Session session = tabletop();
    session.tag.id += 1;
    if (!with_depth) session.depth.reset();
    SceneBuilder builder(session);
    const BuildResult built = builder.build(later(first_frames(session, 1).front(), 0, with_depth));
    EXPECT_FALSE(built.scene.pose || built.scene.field);
    EXPECT_EQ(warnings_of(built.warnings, "tag36h11 " + std::to_string(session.tag.id) + ": not seen").size(), 1u);
  }
  const capture::Session session = tabletop();
  SceneBuilder builder(session);
  EXPECT_TRUE(warnings_of(builder.build(first_frames(session, 1).front()).warnings, "tag36h11").empty());
}

TEST(SceneBuilder, OverridesReplaceEstimates) {
  const capture::Session session = tabletop();
  SceneOverrides overrides;
  Pose elsewhere;
  elsewhere.T_tag_camera.translation() = Eigen::Vector3d(1, 2, 3);
  auto light = std::make_shared<Illumination>();
  light->version = 7;
  light->environment.radiance = capture::Image<float>(8, 4, 3);
  light->environment.clipped = capture::Image<std::uint8_t>(8, 4, 1);
  light->environment.seen = capture::Image<std::uint8_t>(8, 4, 1);
  auto albedo = std::make_shared<AlbedoField>();
  overrides.pose = [&](const capture::FrameSet&) { return elsewhere; };
  overrides.light = [&](const capture::FrameSet&) { return light; };
  overrides.frame = [](const capture::FrameSet& sensed) {
    capture::FrameSet without = sensed;
    without.depth = nullptr;
    return without;
  };
  overrides.albedo = [&](const capture::FrameSet&, const Pose&, const DistanceField&) { return albedo; };
  SceneBuilder builder(session, overrides);
  const std::vector<capture::FrameSet> frames = first_frames(session, 2);
  const BuildResult built = builder.build(frames[0]);
  EXPECT_EQ(built.scene.pose->T_tag_camera.translation(), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(built.scene.illumination, light);
  EXPECT_FALSE(built.frame.depth);
  EXPECT_FALSE(built.scene.field) << "there was no depth";
  EXPECT_FALSE(built.scene.albedo) << "nor a field that it could belong to";

  overrides.frame = nullptr;
  SceneBuilder sensed(session, overrides);
  EXPECT_EQ(sensed.build(frames[0]).scene.albedo, albedo);
}

TEST(SceneBuilder, WhatIsThrownBecomesAWarningOfTheFrame) {
  const capture::Session session = tabletop();
  SceneOverrides overrides;
  overrides.pose = [](const capture::FrameSet& frame) -> Pose {
    throw std::runtime_error("no pose of frame " + std::to_string(frame.index));
  };
  SceneBuilder builder(session, overrides);
  const BuildResult built = builder.build(first_frames(session, 1).front());
  EXPECT_EQ(std::count(built.warnings.begin(), built.warnings.end(), "pose: no pose of frame 0"), 1);
  EXPECT_FALSE(built.scene.pose);
  EXPECT_TRUE(built.scene.illumination) << "the other stages go on";
}

}  // namespace
}  // namespace lumigraft::reconstruct
