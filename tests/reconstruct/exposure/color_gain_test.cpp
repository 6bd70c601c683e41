#include "reconstruct/exposure/color_gain.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "capture/camera/srgb.h"
#include "capture/camera/vignetting.h"
#include "reconstruct/light/fluence.h"
#include "tests/reconstruct/fusion/fusion_views.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Array3f;
using Eigen::Vector3d;

Eigen::Isometry3d view_from(double azimuth_rad) { return test::looking_at_tag(0.9, 0.8, azimuth_rad); }

/// A pattern of paint, W/sr/m².
double paint(const Vector3d& p) { return 0.3 + 0.05 * std::sin(20 * p.x()) * std::sin(17 * p.y()); }

class ColorGain : public testing::Test {
 protected:
  /// One frame from a camera that moves, whose room shines as `radiance` and whose picture is `tint` times as bright,
  /// and exp(-falloff) times in the corners.
  ColorGainStage::Result frame(const std::function<double(const Vector3d&)>& radiance, const Array3f& tint = {1, 1, 1},
                               const std::shared_ptr<const Illumination>& light = nullptr, double falloff = 0) {
    const std::int64_t time_ns = 100'000'000 * static_cast<std::int64_t>(index_);
    const Eigen::Isometry3d pose = view_from(-1.5 + 0.01 * static_cast<double>(index_));
    capture::FrameSet set = test::frame_of(test::ball_on_table, camera_, pose, index_++, {}, radiance);
    auto picture = std::make_shared<capture::Frame>(*set.color);
    if (!tint.isOnes() || falloff != 0) {
      capture::Vignetting lens;
      lens.terms[0] = -falloff / std::pow(capture::corner_angle_rad(camera_), 2);
      for (std::size_t i = 0; i < picture->encoded.data.size(); ++i) {
        const auto x = static_cast<int>(i / 3) % camera_.width, y = static_cast<int>(i / 3) / camera_.width;
        const double angle_rad = std::acos(camera_.unproject({static_cast<double>(x), static_cast<double>(y)})->z());
        const float linear =
            static_cast<float>(lens.transmission(angle_rad)) * capture::srgb_table().linear[picture->encoded.data[i]];
        picture->encoded.data[i] = static_cast<std::uint8_t>(
            std::lround(255 * capture::linear_to_srgb(tint[static_cast<Eigen::Index>(i % 3)] * linear)));
      }
    }
    set.color = picture;
    set.time_ns = time_ns;
    return stage_.estimate(set, test::pose_at(pose), light);
  }

  static std::shared_ptr<const Illumination> lamp_above(float irradiance, std::uint64_t version) {
    auto light = std::make_shared<Illumination>();
    light->version = version;
    PointLight lamp;
    lamp.irradiance.setConstant(irradiance);
    light->lights.push_back(lamp);
    light->environment_sh[0].setConstant(0.3f * irradiance);
    return light;
  }

  /// Half a metre above the table.
  static PointLight lamp_at(int id, float x_m) {
    PointLight lamp;
    lamp.id = id;
    lamp.position_m = {x_m, 0, 0.5f};
    lamp.distance_known = true;
    lamp.direction = lamp.position_m.normalized();
    lamp.intensity.setConstant(0.5f);
    lamp.irradiance = lamp.intensity / lamp.position_m.squaredNorm();
    return lamp;
  }

  capture::CameraModel camera_ = test::small_camera();
  ColorGainStage stage_{test::session_with(camera_)};
  std::uint64_t index_ = 0;
};

TEST_F(ColorGain, ASteadyCameraHasGainOneToTheBit) {
  for (int i = 0; i < 10; ++i) {
    const ColorGainStage::Result result = frame(paint);
    EXPECT_TRUE((result.gain == 1).all()) << result.gain.transpose();
    EXPECT_TRUE(result.warnings.empty());
  }
}

TEST_F(ColorGain, FollowsExposureInTheFrameInWhichItChanges) {
  for (int i = 0; i < 3; ++i) frame(paint);
  for (const float gain : {0.7f, 0.25f, 0.35f, 1.0f}) {
    const ColorGainStage::Result result = frame(paint, Array3f::Constant(gain));
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(result.gain[c] / gain, 1, 0.015) << gain;
    EXPECT_EQ(result.warnings.empty(), gain == 1);
  }
}

TEST_F(ColorGain, FollowsWhiteBalance) {
  for (int i = 0; i < 3; ++i) frame(paint);
  const Array3f tint(1.12f, 1, 0.9f);
  const ColorGainStage::Result result = frame(paint, tint);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(result.gain[c] / tint[c], 1, 0.015);
  ASSERT_EQ(result.warnings.size(), 1u);
}

TEST_F(ColorGain, AShadowOnPartOfTheRoomIsNotTheCamera) {
  for (int i = 0; i < 3; ++i) frame(paint);
  const auto shaded = [](const Vector3d& p) { return (p.x() < -0.1 ? 0.3 : 1) * paint(p); };
  for (int i = 0; i < 10; ++i) EXPECT_NEAR(frame(shaded).gain[1], 1, 0.02);
}

TEST_F(ColorGain, LightThatTheFisheyeSeesChangeIsNotTheCamera) {
  for (int i = 0; i < 3; ++i) frame(paint, {1, 1, 1}, lamp_above(3, 1));
  const auto brighter = [](const Vector3d& p) { return 1.4 * paint(p); };
  EXPECT_NEAR(frame(brighter, {1, 1, 1}, lamp_above(1.4f * 3, 2)).gain[1], 1, 0.015);
  // The same room in the same picture under more light: the camera sees less of it.
  EXPECT_NEAR(frame(paint, {1, 1, 1}, lamp_above(2 * 3, 3)).gain[1], 0.5, 0.01);
}

TEST_F(ColorGain, FollowsACameraThatAdaptsToLightThatChanges) {
  const auto up = [](const std::shared_ptr<const Illumination>& light) {
    return unoccluded_irradiance(*light, Eigen::Vector3f::Zero(), Eigen::Vector3f::UnitZ())[1];
  };
  // The lamp alone dims: the table's light changes more than the mean around the fish-eye.
  const auto dimmed = [](float power, std::uint64_t version) {
    auto light = std::make_shared<Illumination>(*lamp_above(3, version));
    light->lights[0].irradiance *= power;
    return light;
  };
  const float before = up(dimmed(1, 1));
  for (int i = 0; i < 3; ++i) frame(paint, {1, 1, 1}, dimmed(1, 1));
  std::uint64_t version = 1;
  for (const float power : {0.85f, 0.7f, 0.55f, 0.4f, 0.3f, 0.3f, 0.4f, 0.55f, 0.7f, 0.85f, 1.0f}) {
    const auto light = dimmed(power, ++version);
    const float fraction = up(light) / before, gain = std::pow(fraction, -0.6f);
    const auto darker = [&](const Vector3d& p) { return fraction * paint(p); };
    EXPECT_NEAR(frame(darker, Array3f::Constant(gain), light).gain[1] / gain, 1, 0.02) << power;
  }
}

TEST_F(ColorGain, FollowsAGainThatCreeps) {
  int index = 0;
  const auto uneven = [&](const Vector3d& p) {
    return paint(p) * (1 + 0.08 * std::sin(60 * p.x() + 2.1 * index) * std::sin(50 * p.y() + index));
  };
  for (; index < 6; ++index) frame(uneven);
  for (float gain = 1; index < 14; ++index) {
    gain *= 1.05f;
    EXPECT_NEAR(frame(uneven, Array3f::Constant(gain)).gain[1] / gain, 1, 0.02) << index;
  }
}

TEST_F(ColorGain, TellsALampThatIsOffFromACoveredOne) {
  const auto two_lamps = [](std::uint64_t version, int hidden) {
    auto light = std::make_shared<Illumination>(*lamp_above(2, version));
    light->lights.push_back(light->lights[0]);
    light->lights[1].id = 7;
    light->lights[1].irradiance.setConstant(1);
    light->lights[1].hidden = hidden;
    return light;
  };
  const auto steady = [&] {
    for (std::uint64_t i = 1; i <= 3; ++i) frame(paint, {1, 1, 1}, two_lamps(i, 0));
  };
  steady();
  const ColorGainStage::Result covered = frame(paint, {1, 1, 1}, two_lamps(4, 1));
  EXPECT_EQ(covered.light.lit, std::vector{7});
  EXPECT_TRUE(covered.light.off.empty());
  // Of 3 W/m² of the lamps and the environment's, one is missing.
  const double all = unoccluded_irradiance(*two_lamps(1, 0), {0, 0, 0}, {0, 0, 1})[1];
  const auto darker = [&](const Vector3d& p) { return (all - 1) / all * paint(p); };
  const ColorGainStage::Result off = frame(darker, {1, 1, 1}, two_lamps(5, 1));
  EXPECT_EQ(off.light.off, std::vector{7});
  EXPECT_NEAR(off.gain[1], 1, 0.02) << "not the camera";
}

// Automatic exposure answers in the frame in which a lamp at one side goes off.
TEST_F(ColorGain, ALampThatGoesOffWhileTheGainChangesIsOff) {
  const auto two_lamps = [&](std::uint64_t version, int hidden) {
    auto light = std::make_shared<Illumination>(*lamp_above(0.3f, version));
    light->lights = {lamp_at(3, -0.4f), lamp_at(7, 0.4f)};
    light->lights[1].hidden = hidden;
    return light;
  };
  const auto lit_by = [](const std::shared_ptr<const Illumination>& light) {
    return [light](const Vector3d& p) {
      return paint(p) * unoccluded_irradiance(*light, p.cast<float>(), {0, 0, 1})[1] / 4;
    };
  };
  for (std::uint64_t i = 1; i <= 3; ++i) frame(lit_by(two_lamps(i, 0)), {1, 1, 1}, two_lamps(i, 0));
  const ColorGainStage::Result covered = frame(lit_by(two_lamps(4, 0)), Array3f::Constant(0.7f), two_lamps(4, 1));
  EXPECT_EQ(covered.light.lit, std::vector{7});
  auto one = std::make_shared<Illumination>(*two_lamps(5, 1));
  one->lights.pop_back();
  const ColorGainStage::Result off = frame(lit_by(one), Array3f::Constant(1.6f), two_lamps(5, 1));
  EXPECT_EQ(off.light.off, std::vector{7});
  EXPECT_NEAR(off.gain[1], 1.6, 0.05);

  // On again, before its distance is known again.
  for (std::uint64_t i = 6; i < 18; ++i) {
    auto still_off = std::make_shared<Illumination>(*one);
    still_off->version = i;
    frame(lit_by(one), Array3f::Constant(1.8f), still_off);
  }
  auto again = std::make_shared<Illumination>(*two_lamps(18, 0));
  again->lights[1].distance_known = false;
  EXPECT_NEAR(frame(lit_by(two_lamps(1, 0)), Array3f::Constant(0.8f), again).gain[1], 0.8, 0.01);
}

// Its light is what the frame shows, and not that of the fish-eye, which still counts the lamp as hidden.
TEST_F(ColorGain, WhileALampIsOffPlacesAreComparedUnderThatLight) {
  const auto two_lamps = [&](int hidden) {
    auto light = std::make_shared<Illumination>(*lamp_above(0.3f, index_ + 1));
    light->time_ns = 100'000'000 * static_cast<std::int64_t>(index_);
    light->lights = {lamp_at(3, -0.4f), lamp_at(7, 0.4f)};
    light->lights[1].hidden = hidden;
    return light;
  };
  // Of the lamp with id 7 a part of the table is in shadow.
  const auto room = [&](bool lit) {
    const auto all = two_lamps(0);
    return [all, lit](const Vector3d& p) {
      Illumination light = *all;
      if (!lit || std::sin(25 * p.y()) > 0.3) light.lights.pop_back();
      return paint(p) * unoccluded_irradiance(light, p.cast<float>(), {0, 0, 1})[1] / 4;
    };
  };
  for (int i = 0; i < 3; ++i) frame(room(true), {1, 1, 1}, two_lamps(0));
  for (const float gain : {1.0f, 1.0f, 1.0f, 1.5f, 0.8f}) {
    const ColorGainStage::Result off = frame(room(false), Array3f::Constant(gain), two_lamps(1));
    EXPECT_EQ(off.light.off, std::vector{7}) << gain;
    EXPECT_NEAR(off.gain[1] / gain, 1, 0.02) << gain;
  }
}

// A frame whose gain is not known, as places contradict its light, changes nothing that is remembered.
TEST_F(ColorGain, PlacesAreNotLearntWithAnUnknownGain) {
  const auto lamp_on_side = [&](float x_m) {
    auto light = std::make_shared<Illumination>(*lamp_above(0.3f, index_ + 1));
    light->time_ns = 100'000'000 * static_cast<std::int64_t>(index_);
    light->lights = {lamp_at(0, x_m)};
    return light;
  };
  const auto lit_by = [](const std::shared_ptr<const Illumination>& light, double contradiction) {
    return [=](const Vector3d& p) {
      const double stripe = std::fmod(std::floor(20 * (p.x() + 5)), 3);  // as bright as predicted, or less
      return paint(p) * unoccluded_irradiance(*light, p.cast<float>(), {0, 0, 1})[1] * std::pow(contradiction, stripe) /
             3;
    };
  };
  for (int i = 0; i < 3; ++i) {
    const auto left = lamp_on_side(-0.4f);
    frame(lit_by(left, 1), {1, 1, 1}, left);
  }
  auto right = lamp_on_side(0.4f);
  EXPECT_EQ(frame(lit_by(right, 0.5), Array3f::Constant(1.5f), right).gain[1], 1) << "unknown";
  right = lamp_on_side(0.4f);
  EXPECT_NEAR(frame(lit_by(right, 1), Array3f::Constant(1.5f), right).gain[1], 1.5, 0.05);
}

TEST_F(ColorGain, LampsThatGoOutTogetherAreOff) {
  const auto two_lamps = [](std::uint64_t version, int hidden) {
    auto light = std::make_shared<Illumination>(*lamp_above(2, version));
    light->lights.push_back(light->lights[0]);
    light->lights[1].id = 7;
    for (PointLight& lamp : light->lights) lamp.hidden = hidden;
    if (hidden > 0) light->environment_sh = zero_sh();
    return light;
  };
  for (std::uint64_t i = 1; i <= 3; ++i) frame(paint, {1, 1, 1}, two_lamps(i, 0));
  const auto black = [](const Vector3d&) { return 0.0; };
  const ColorGainStage::Result off = frame(black, {1, 1, 1}, two_lamps(4, 1));
  EXPECT_EQ(off.light.off, (std::vector{0, 7}));
  EXPECT_EQ(off.gain[1], 1);
  ASSERT_EQ(off.warnings.size(), 1u);
  EXPECT_NE(off.warnings[0].find("too dark"), std::string::npos) << off.warnings[0];
  EXPECT_TRUE(frame(paint, {1, 1, 1}, two_lamps(5, 0)).warnings.empty()) << "on again";
}

TEST_F(ColorGain, LightThatChangesWithoutANewFisheyeFrameIsReported) {
  const auto light = lamp_above(3, 1);
  const auto moved = [](const Vector3d& p) { return 0.5 * std::exp(3 * p.x()) * paint(p); };
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(frame(paint, {1, 1, 1}, light).warnings.empty()) << "nothing changes";
  for (int i = 0; i < 20; ++i) {
    const ColorGainStage::Result result = frame(moved, {1, 1, 1}, light);
    EXPECT_NEAR(result.gain[1], 1, 0.05);
    ASSERT_EQ(result.warnings.size(), 1u) << i;
    EXPECT_NE(result.warnings[0].find("no new frame"), std::string::npos) << result.warnings[0];
  }
  const auto newest = std::make_shared<Illumination>(*lamp_above(2, 2));
  newest->time_ns = 4'000'000'000;
  const ColorGainStage::Result result = frame(moved, {1, 1, 1}, newest);
  EXPECT_TRUE(result.warnings.empty());
  EXPECT_NEAR(result.gain[1], 1, 0.05) << "the change was before";
}

/// Two lamps near the table, one on each side, and a dim environment; `left`: power of the first.
std::shared_ptr<const Illumination> lamps_beside(std::uint64_t version, float left) {
  auto light = std::make_shared<Illumination>();
  light->version = version;
  light->environment_sh[0].setConstant(0.1f);
  for (const float side : {-1.0f, 1.0f}) {
    PointLight& lamp = light->lights.emplace_back();
    lamp.id = side < 0 ? 3 : 8;
    lamp.distance_known = true;
    lamp.position_m = {0.5f * side, 0, 0.35f};
    lamp.direction = lamp.position_m.normalized();
    lamp.intensity.setConstant(side < 0 ? 0.3f * left : 0.3f);
    lamp.irradiance = lamp.intensity / lamp.position_m.squaredNorm();
  }
  return light;
}

TEST_F(ColorGain, ShowsWhichLampIsDimmerWhileTheFisheyeIsSilent) {
  const auto lit = [](float left) {
    return [light = lamps_beside(0, left)](const Vector3d& p) {
      return paint(p) * unoccluded_irradiance(*light, p.cast<float>(), {0, 0, 1})[1] / 2;
    };
  };
  const auto image = lamps_beside(1, 1);
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(frame(lit(1), {1, 1, 1}, image).light.dimming);
  for (const float left : {0.2f, 0.0f}) {
    const ColorGainStage::Result result = frame(lit(left), {1, 1, 1}, image);
    ASSERT_TRUE(result.light.dimming) << left;
    EXPECT_NEAR(result.light.dimming->lamps.at(3)[1], left, 0.05);
    EXPECT_NEAR(result.light.dimming->lamps.at(8)[1], 1, 0.05);
    EXPECT_NEAR(result.gain[1], 1, 0.02) << "not the camera";
  }
  auto dimmed = std::make_shared<Illumination>(*lamps_beside(2, 0.2f));
  dimmed->dimmed = true;
  for (int i = 0; i < 5; ++i) {
    const ColorGainStage::Result result = frame(lit(0.2f), {1, 1, 1}, dimmed);
    EXPECT_FALSE(result.light.dimming) << "it agrees";
    EXPECT_NEAR(result.gain[1], 1, 0.03);
    ASSERT_EQ(result.warnings.size(), i > 0 ? 1u : 0u) << i;
    if (i == 0) continue;
    EXPECT_NE(result.warnings[0].find("as bright as the colour frames show"), std::string::npos);
  }
  const ColorGainStage::Result on_again = frame(lit(1), {1, 1, 1}, dimmed);
  ASSERT_TRUE(on_again.light.dimming);
  EXPECT_NEAR(on_again.light.dimming->lamps.at(3)[1], 1, 0.05) << "relative to the fish-eye's image";
}

TEST_F(ColorGain, KnowingALampBetterIsNoChangeOfLight) {
  const auto lit = [](float left) {
    return [light = lamps_beside(0, left)](const Vector3d& p) {
      return paint(p) * unoccluded_irradiance(*light, p.cast<float>(), {0, 0, 1})[1] / 2;
    };
  };
  // Of the same image: at first the lamps are supposed to be infinitely far, and one is clipped.
  auto guessed = std::make_shared<Illumination>(*lamps_beside(1, 0.4f));
  for (PointLight& lamp : guessed->lights) lamp.distance_known = false;
  guessed->lights[0].clipped = true;
  for (int i = 0; i < 3; ++i) frame(lit(1), {1, 1, 1}, guessed);
  auto known = std::make_shared<Illumination>(*lamps_beside(1, 1));
  known->lights[0].clipped = true;
  EXPECT_FALSE(frame(lit(1), {1, 1, 1}, known).light.dimming);
  for (const float left : {0.0f, 1.0f}) {
    const ColorGainStage::Result result = frame(lit(left), {1, 1, 1}, known);
    if (left == 1) {
      EXPECT_FALSE(result.light.dimming);
      continue;
    }
    ASSERT_TRUE(result.light.dimming);
    EXPECT_NEAR(result.light.dimming->lamps.at(3)[1], 0, 0.05);
    EXPECT_NEAR(result.light.dimming->lamps.at(8)[1], 1, 0.05);
  }
}

TEST_F(ColorGain, ACoveredLensShowsNoRoom) {
  const auto image = lamps_beside(1, 1);
  const auto room = [](const Vector3d& p) {
    return paint(p) * unoccluded_irradiance(*lamps_beside(0, 1), p.cast<float>(), {0, 0, 1})[1] / 2;
  };
  const auto dark = [](const Vector3d&) { return 1e-4; };
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(frame(room, {1, 1, 1}, image).shows_room);
  const auto dimmed = std::make_shared<Illumination>(*image);
  dimmed->dimmed = true;
  for (PointLight& lamp : dimmed->lights) {
    lamp.intensity *= 0.001f;
    lamp.irradiance *= 0.001f;
  }
  dimmed->environment_sh[0] *= 0.001f;
  for (int i = 0; i < 20; ++i) EXPECT_FALSE(frame(dark, {1, 1, 1}, i == 0 ? image : dimmed).shows_room);
  const ColorGainStage::Result back = frame(room, {1, 1, 1}, dimmed);
  EXPECT_TRUE(back.shows_room);
  ASSERT_TRUE(back.light.dimming);
  for (const auto& [id, power] : back.light.dimming->lamps) EXPECT_EQ(power[1], 1) << id;
  EXPECT_EQ(back.light.dimming->environment[1], 1);
  EXPECT_TRUE(frame(room, {1, 1, 1}, image).gain.isOnes(0));
}

TEST_F(ColorGain, WhatNoLightExplainsIsNotTheRoomForAMoment) {
  const auto covered = [](const Vector3d& p) {
    return 0.3 * std::exp(3 * std::sin(40 * p.x()) * std::cos(30 * p.y()));
  };
  const auto image = lamp_above(3, 1);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(frame(paint, {1, 1, 1}, image).shows_room);
  for (int i = 0; i < 8; ++i) EXPECT_FALSE(frame(covered, {1, 1, 1}, image).shows_room) << i;
  EXPECT_TRUE(frame(covered, {1, 1, 1}, image).shows_room) << "the room is another one";
}

TEST_F(ColorGain, PlacesSeenBeforeTheFirstFisheyeFrameFollowItsLight) {
  for (int i = 0; i < 3; ++i) frame(paint);
  for (std::uint64_t i = 0; i < 3; ++i) frame(paint, {1, 1, 1}, lamp_above(3, 1));
  const auto brighter = [](const Vector3d& p) { return 1.4 * paint(p); };
  EXPECT_NEAR(frame(brighter, {1, 1, 1}, lamp_above(1.4f * 3, 2)).gain[1], 1, 0.015);
}

TEST_F(ColorGain, ALampWhoseDistanceIsNotKnownYetIsNotTheCamera) {
  const auto lamp_near = [](std::uint64_t version, float x_m, bool known) {
    auto light = std::make_shared<Illumination>(*lamp_above(1, version));
    PointLight& lamp = light->lights[0];
    lamp.direction = Eigen::Vector3f(x_m, 0, 0.5f).normalized();
    lamp.position_m = {x_m, 0, 0.5f};
    lamp.intensity.setConstant(0.3f);
    lamp.distance_known = known;
    return light;
  };
  for (std::uint64_t i = 1; i <= 3; ++i) frame(paint, {1, 1, 1}, lamp_near(i, 0, true));
  for (std::uint64_t i = 4; i <= 8; ++i) {
    const auto brighter = [&](const Vector3d& p) { return (1 + 0.03 * static_cast<double>(i)) * paint(p); };
    EXPECT_EQ(frame(brighter, {1, 1, 1}, lamp_near(i, 0.05f * static_cast<float>(i), i % 2 == 0)).gain[1], 1);
  }
}

/// A fish-eye above the ball that sees the table, of the frame's own colours.
std::shared_ptr<const Illumination> fisheye_above() {
  auto light = std::make_shared<Illumination>();
  light->version = 1;
  light->probe_position_m = {0, 0, 0.6f};
  light->environment.radiance = capture::Image<float>(128, 64, 3);
  for (int v = 0; v < 64; ++v) {
    for (int u = 0; u < 128; ++u) {
      const double phi = (2 * (u + 0.5) / 128 - 1) * std::numbers::pi, theta = (v + 0.5) / 64 * std::numbers::pi;
      const Vector3d ray(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
      const double radiance = ray.z() < 0 ? paint(Vector3d(0, 0, 0.6) - 0.6 / ray.z() * ray) : 1;
      for (int c = 0; c < 3; ++c) light->environment.radiance.at(u, v, c) = static_cast<float>(radiance / (1 + c));
    }
  }
  return light;
}

TEST_F(ColorGain, AWhiteBalanceOtherThanTheFisheyesIsFoundInTheFirstFrame) {
  const Array3f tint(0.62f, 1, 1.4f);
  for (int i = 0; i < 10; ++i) {
    const ColorGainStage::Result result = frame(paint, tint, fisheye_above());
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(result.gain[c] / tint[c], 1, 0.03) << c;
    EXPECT_EQ(result.correction > 0, i == 0);
    EXPECT_FALSE(result.vignetting);
    ASSERT_EQ(result.warnings.size(), 1u);
    EXPECT_NE(result.warnings[0].find("times as bright as the fish-eye"), std::string::npos) << result.warnings[0];
  }
}

TEST_F(ColorGain, VignettingIsFoundFromWhatTheFisheyeSees) {
  const double falloff = 0.6;
  for (int i = 0; i < 3; ++i) {
    const ColorGainStage::Result result = frame(paint, {1, 1, 1}, fisheye_above(), falloff);
    EXPECT_TRUE((result.gain == 1).all()) << result.gain.transpose();
    ASSERT_TRUE(result.vignetting);
    EXPECT_NEAR(std::log(result.vignetting->at(0, 0)), falloff, 0.1);
    EXPECT_NEAR(result.vignetting->at(camera_.width / 2, camera_.height / 2), 1, 0.01);
  }
}

TEST_F(ColorGain, AgreementWithTheFisheyeChangesNothing) {
  for (int i = 0; i < 10; ++i) {
    const ColorGainStage::Result result = frame(paint, {1, 1, 1}, fisheye_above());
    EXPECT_TRUE((result.gain == 1).all());
    EXPECT_EQ(result.correction, 0);
    EXPECT_FALSE(result.vignetting);
    EXPECT_TRUE(result.warnings.empty());
  }
}

TEST_F(ColorGain, IsHeldWhereNothingDeterminesIt) {
  for (int i = 0; i < 3; ++i) frame(paint);
  const Array3f half = Array3f::Constant(0.5f);
  ASSERT_NEAR(frame(paint, half).gain[0], 0.5, 0.01);
  const auto other = [](const Vector3d& p) { return p.x() < -0.05 ? 0.1 : p.x() < 0.05 ? 0.2 : 0.45; };
  EXPECT_NEAR(frame(other).gain[0], 0.5, 0.01) << "light changed in three ways";
  EXPECT_NEAR(stage_.estimate({}, std::nullopt, nullptr).gain[0], 0.5, 0.01) << "nothing seen";
}

}  // namespace
}  // namespace lumigraft::reconstruct
