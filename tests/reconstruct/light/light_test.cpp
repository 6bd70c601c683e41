#include "reconstruct/light/light.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "capture/camera/srgb.h"
#include "reconstruct/light/environment.h"

namespace lumigraft::reconstruct {
namespace {

capture::Session session_with_fisheye() {
  capture::Session session;
  capture::FisheyeCamera camera;
  camera.model.kind = capture::CameraModel::Kind::equidistant;
  camera.model.width = camera.model.height = 256;
  camera.model.fx = camera.model.fy = 77;
  camera.model.cx = camera.model.cy = 127.5;
  camera.model.fov_rad = 190 * std::numbers::pi / 180;
  camera.exposure = 5;
  camera.T_tag_fisheye.translation() = Eigen::Vector3d(-0.2, 0.1, 0.03);
  session.fisheye = camera;
  return session;
}

const Eigen::Vector3f kLampA = Eigen::Vector3f(1, 0, 1).normalized();
const Eigen::Vector3f kLampB = Eigen::Vector3f(-1, -1, 1).normalized();

float radiance_towards(const Eigen::Vector3f& d, float strength) {
  if (d.dot(kLampA) > std::cos(0.06f)) return 40 * strength;
  if (d.dot(kLampB) > std::cos(0.06f)) return 20;
  return 0.1f;
}

capture::FrameSet frame_with_lamps(const capture::Session& session, float strength = 1) {
  const FisheyeView view = fisheye_view(*session.fisheye);
  auto picture = std::make_shared<capture::Frame>();
  picture->stream = capture::Stream::fisheye;
  picture->radiance = capture::Image<float>(view.width, view.height, 3);
  for (std::size_t i = 0; i < view.direction.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      picture->radiance.data[3 * i + c] = view.sees(i) ? radiance_towards(view.direction[i], strength) : 0;
    }
  }
  capture::FrameSet frame;
  frame.fisheye.push_back(picture);
  return frame;
}

capture::FrameSet frame_without_lamp_a(const capture::Session& session) {
  capture::FrameSet frame = frame_with_lamps(session);
  auto picture = std::make_shared<capture::Frame>(*frame.fisheye[0]);
  for (float& value : picture->radiance.data) value = value > 30 ? 0.02f : value;
  frame.fisheye = {picture};
  return frame;
}

TEST(LightStage, LampsKeepTheirIdsAndAnEqualImageChangesNothing) {
  const capture::Session session = session_with_fisheye();
  LightStage stage(session);
  const auto first = stage.extract(frame_with_lamps(session));
  ASSERT_TRUE(first.illumination);
  EXPECT_TRUE(first.warnings.empty());
  ASSERT_EQ(first.illumination->lights.size(), 2u);
  EXPECT_LT((first.illumination->probe_position_m - Eigen::Vector3f(-0.2f, 0.1f, 0.03f)).norm(), 1e-6);
  EXPECT_GT(first.illumination->lights[0].direction.dot(kLampA), std::cos(0.003f));
  EXPECT_NEAR(first.illumination->lights[0].angular_radius_rad, 0.06, 0.004);
  EXPECT_FALSE(first.illumination->lights[0].distance_known);

  const auto again = stage.extract(frame_with_lamps(session));  // another image with the same content
  EXPECT_EQ(again.illumination, first.illumination);
  EXPECT_EQ(stage.extract(capture::FrameSet()).illumination, first.illumination);

  // Lamp A gets weaker than B: the order changes, the ids do not.
  const auto dimmed = stage.extract(frame_with_lamps(session, 0.25f));
  EXPECT_GT(dimmed.illumination->version, first.illumination->version);
  ASSERT_EQ(dimmed.illumination->lights.size(), 2u);
  EXPECT_EQ(dimmed.illumination->lights[0].id, first.illumination->lights[1].id);
  EXPECT_EQ(dimmed.illumination->lights[1].id, first.illumination->lights[0].id);
  EXPECT_NEAR(dimmed.illumination->lights[1].irradiance.x() / first.illumination->lights[0].irradiance.x(), 0.25, 0.01);
}

TEST(LightStage, ARepeatedImageIsAsOldAsTheFirst) {
  const capture::Session session = session_with_fisheye();
  LightStage stage(session);
  const auto at = [](capture::FrameSet frame, std::int64_t time_ns) {
    auto picture = std::make_shared<capture::Frame>(*frame.fisheye[0]);
    picture->stamp.time_ns = time_ns;
    frame.fisheye = {picture};
    return frame;
  };
  EXPECT_EQ(stage.extract(at(frame_with_lamps(session), 1)).illumination->time_ns, 1);
  EXPECT_EQ(stage.extract(at(frame_with_lamps(session), 2)).illumination->time_ns, 1);
  EXPECT_EQ(stage.extract(at(frame_without_lamp_a(session), 3)).illumination->time_ns, 3);
  EXPECT_EQ(stage.extract(at(frame_without_lamp_a(session), 4)).illumination->time_ns, 3) << "while a lamp fades";
}

TEST(LightStage, SmallChangesAreAveraged) {
  const capture::Session session = session_with_fisheye();
  LightStage stage(session);
  const auto first = stage.extract(frame_with_lamps(session, 1.00f)).illumination;
  const auto second = stage.extract(frame_with_lamps(session, 1.04f)).illumination;
  EXPECT_NEAR(second->lights[0].irradiance.x() / first->lights[0].irradiance.x(), 1.02, 0.002);
}

TEST(LightStage, ClippedLampsGiveAWarning) {
  const capture::Session session = session_with_fisheye();
  capture::FrameSet frame = frame_with_lamps(session);
  auto picture = std::make_shared<capture::Frame>(*frame.fisheye[0]);
  picture->exposure = 5;
  picture->encoded = capture::Image<std::uint8_t>(256, 256, 3);
  for (std::size_t i = 0; i < picture->encoded.data.size(); ++i) {
    picture->encoded.data[i] = static_cast<std::uint8_t>(
        std::lround(255 * capture::linear_to_srgb(std::min(1.0f, 5 * picture->radiance.data[i]))));
  }
  picture->radiance = {};
  frame.fisheye = {picture};
  LightStage stage(session);
  const auto result = stage.extract(frame);
  ASSERT_EQ(result.illumination->lights.size(), 2u);
  EXPECT_TRUE(result.illumination->lights[0].clipped);
  ASSERT_EQ(result.warnings.size(), 1u);
  EXPECT_NE(result.warnings[0].find("2 lamps are clipped in the fish-eye frame: their power is a lower bound (0."),
            std::string::npos)
      << result.warnings[0];
}

TEST(LightStage, VignettingIsRemoved) {
  capture::Session session = session_with_fisheye();
  capture::FrameSet frame = frame_with_lamps(session);
  LightStage plain(session);
  const auto truth = plain.extract(frame).illumination;
  const capture::Vignetting falloff{{-0.25, 0.03, -0.02}};
  auto picture = std::make_shared<capture::Frame>(*frame.fisheye[0]);
  const capture::Image<float> gain = capture::vignetting_gain(falloff, session.fisheye->model);
  picture->exposure = 0.9 / *std::max_element(picture->radiance.data.begin(), picture->radiance.data.end());
  picture->encoded = capture::Image<std::uint8_t>(256, 256, 3);
  for (std::size_t i = 0; i < picture->encoded.data.size(); ++i) {
    const double light = picture->exposure * picture->radiance.data[i] / gain.data[i / 3];
    picture->encoded.data[i] =
        static_cast<std::uint8_t>(std::lround(255 * capture::linear_to_srgb(static_cast<float>(light))));
  }
  picture->radiance = {};
  const auto lamps = [&](const capture::FrameSet& seen) {
    LightStage stage(session);
    const auto found = stage.extract(seen).illumination;
    EXPECT_EQ(found->lights.size(), truth->lights.size());
    return found->lights.at(0).irradiance.x() / truth->lights[0].irradiance.x();
  };
  capture::FrameSet through_lens = frame;
  through_lens.fisheye = {picture};
  EXPECT_LT(lamps(through_lens), 0.93) << "without the correction";
  session.fisheye->vignetting = falloff;
  EXPECT_NEAR(lamps(through_lens), 1.0, 0.02);
  EXPECT_NEAR(lamps(frame), 1.0, 1e-5) << "radiance images are already corrected";
}

/// The colour image of the room with the lamps on.
std::shared_ptr<const capture::Frame> room_picture(float radiance) {
  auto picture = std::make_shared<capture::Frame>();
  picture->radiance = capture::Image<float>(64, 48, 3, radiance);
  return picture;
}

TEST(LightStage, LampCoveredForOneFrameStaysAndOneThatWentOutFades) {
  const capture::Session session = session_with_fisheye();
  LightStage stage(session);
  const auto before = stage.extract(frame_with_lamps(session)).illumination;
  const auto covered = stage.extract(frame_without_lamp_a(session));
  ASSERT_EQ(covered.illumination->lights.size(), 2u);
  EXPECT_EQ(covered.illumination->lights[1].id, before->lights[0].id);
  EXPECT_EQ(covered.illumination->lights[1].hidden, 1);
  EXPECT_EQ(covered.illumination->lights[1].irradiance, before->lights[0].irradiance);
  ASSERT_EQ(covered.warnings.size(), 1u);
  EXPECT_NE(covered.warnings[0].find("1 lamp is no longer visible"), std::string::npos);
  const auto again = stage.extract(frame_with_lamps(session));
  ASSERT_EQ(again.illumination->lights.size(), 2u);
  EXPECT_EQ(again.illumination->lights[0].id, before->lights[0].id);
  EXPECT_EQ(again.illumination->lights[0].hidden, 0);
  EXPECT_TRUE(again.warnings.empty());

  float last = before->lights[0].irradiance.x(), largest_step = 0;
  for (int i = 0; i < 10; ++i) {  // frames count even if the image does not change
    const auto lights = stage.extract(frame_without_lamp_a(session)).illumination->lights;
    const float now = lights.size() < 2 ? 0 : lights[1].irradiance.x();
    largest_step = std::max(largest_step, last - now);
    last = now;
  }
  EXPECT_EQ(last, 0);
  EXPECT_LT(largest_step, 0.26f * before->lights[0].irradiance.x());
}

TEST(LightStage, DimmingHoldsUntilTheNextImage) {
  const capture::Session session = session_with_fisheye();
  LightStage stage(session);
  capture::FrameSet frame = frame_with_lamps(session);
  const auto bright = stage.extract(frame).illumination;
  const int id = bright->lights[0].id, out = bright->lights[1].id;
  Dimming dimming{.since_ns = bright->time_ns, .lamps = {}, .environment = {0.5f, 0.5f, 0.5f}};
  dimming.lamps = {{id, {0.25f, 0.5f, 1}}, {out, {0, 0, 0}}};
  stage.resolve({.off = {}, .lit = {}, .dimming = dimming});
  const auto dim = stage.extract(frame).illumination;
  EXPECT_GT(dim->version, bright->version);
  EXPECT_TRUE(dim->dimmed);
  EXPECT_EQ(dim->time_ns, bright->time_ns);
  ASSERT_EQ(dim->lights.size(), bright->lights.size() - 1);
  EXPECT_TRUE(
      dim->lights[0].irradiance.isApprox(bright->lights[0].irradiance.cwiseProduct(Eigen::Vector3f(0.25f, 0.5f, 1))));
  EXPECT_TRUE(dim->environment_sh[0].isApprox(0.5f * bright->environment_sh[0]));
  EXPECT_EQ(stage.extract(frame).illumination, dim) << "no new image";
  auto newer = std::make_shared<capture::Frame>(*frame.fisheye.front());
  newer->stamp.time_ns += 100'000'000;
  if (newer->radiance.empty())
    newer->encoded.data[0] ^= 1;
  else
    newer->radiance.data[0] += 1e-4f;
  frame.fisheye = {newer};
  EXPECT_FALSE(stage.extract(frame).illumination->dimmed);
}

TEST(LightStage, WhatTheColourCameraShowsDecidesAboutAHiddenLamp) {
  const capture::Session session = session_with_fisheye();
  LightStage stage(session);
  const int id = stage.extract(frame_with_lamps(session)).illumination->lights[0].id;
  const capture::FrameSet covered = frame_without_lamp_a(session);
  for (int i = 0; i < 20; ++i) {
    const auto lights = stage.extract(covered).illumination->lights;
    ASSERT_EQ(lights.size(), 2u) << "held as long as its light is there";
    EXPECT_EQ(lights[1].id, id);
    stage.resolve({.off = {}, .lit = {id}, .dimming = {}});
  }
  const std::uint64_t version = stage.extract(covered).illumination->version;
  stage.resolve({.off = {id}, .lit = {}, .dimming = {}});
  const auto off = stage.extract({}, nullptr, {}).illumination;
  EXPECT_EQ(off->lights.size(), 1u) << "without a new image";
  EXPECT_GT(off->version, version);
  EXPECT_EQ(stage.extract(covered).illumination->lights.size(), 1u);
  EXPECT_EQ(stage.extract(frame_with_lamps(session)).illumination->lights[0].id, id) << "switched on again";
}

TEST(LightStage, MovedLampIsNotDuplicated) {
  const capture::Session session = session_with_fisheye();
  LightStage stage(session);
  stage.extract(frame_with_lamps(session));
  capture::Session turned = session;
  turned.fisheye->T_tag_fisheye.linear() = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const capture::FrameSet frame = frame_with_lamps(turned);  // a turned camera: all lamps elsewhere in the image
  EXPECT_EQ(stage.extract(frame).illumination->lights.size(), 2u);
}

TEST(LightStage, CoveredFisheyeGivesAWarningAndTheLightStays) {
  const capture::Session session = session_with_fisheye();
  LightStage stage(session);
  capture::FrameSet open = frame_with_lamps(session), dark = open;
  open.color = dark.color = room_picture(0.3f);
  auto black = std::make_shared<capture::Frame>(*open.fisheye[0]);
  for (float& value : black->radiance.data) value *= 1e-3f;
  dark.fisheye = {black};
  const auto before = stage.extract(open);
  EXPECT_TRUE(before.warnings.empty());
  const auto covered = stage.extract(dark);
  EXPECT_EQ(covered.illumination, before.illumination);
  ASSERT_EQ(covered.warnings.size(), 1u);
  EXPECT_NE(covered.warnings[0].find("the fish-eye is covered"), std::string::npos) << covered.warnings[0];
  EXPECT_TRUE(stage.extract(open).warnings.empty());

  // The lamps went out: the colour camera sees that too.
  dark.color = room_picture(0.001f);
  const auto out = stage.extract(dark);
  EXPECT_NE(out.illumination, before.illumination);
  // Its noise is no light.
  auto noise = std::make_shared<capture::Frame>();
  noise->encoded = capture::Image<std::uint8_t>(64, 48, 3, 12);
  dark.color = noise;
  for (const std::string& warning : stage.extract(dark).warnings)
    EXPECT_EQ(warning.find("far less light"), std::string::npos) << warning;
  // A fish-eye that has been dark from the start, in a lit room.
  dark.color = room_picture(0.3f);
  const auto from_the_start = LightStage(session).extract(dark);
  ASSERT_EQ(from_the_start.warnings.size(), 1u);
  EXPECT_NE(from_the_start.warnings[0].find("the fish-eye measures far less light than the room reflects"),
            std::string::npos);
}

TEST(LightStage, WithoutAnImageLightIsUnknown) {
  LightStage stage(session_with_fisheye());
  const auto result = stage.extract(capture::FrameSet());
  EXPECT_FALSE(result.illumination);
  EXPECT_EQ(result.warnings.size(), 1u);
}

}  // namespace
}  // namespace lumigraft::reconstruct
