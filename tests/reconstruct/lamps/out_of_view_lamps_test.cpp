// Lamps with tags: their distance is given; the power of those that the fish-eye does not see is estimated.
#include "reconstruct/lamps/out_of_view_lamps.h"

#include <gtest/gtest.h>

#include "reconstruct/albedo/albedo.h"
#include "reconstruct/light/fluence.h"
#include "tests/reconstruct/albedo/albedo_room.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

constexpr float kConfiguredSigma = 0.1f;  // 1σ of a configured log power

TestLamp bulb() { return {{0.4f, -0.5f, 0.9f}, {1.2f, 1.0f, 0.8f}, 0.04f}; }
TestLamp desk_lamp() { return {{-0.35f, 0.3f, 0.4f}, {0.3f, 0.25f, 0.2f}, 0.03f}; }

/// A floor with a bulb that the fish-eye sees and a lamp with a tag, which it does not.
TestRoom room_with_both() {
  TestRoom room;
  room.lamps = {bulb(), desk_lamp()};
  room.ambient = Vector3f::Constant(0.02f);
  room.boxes = {{{0.05f, -0.1f, 0.0f}, {0.15f, 0.05f, 0.15f}}};
  return room;
}

/// `times`: the configured power over the true one; 0: none is configured.
Illumination unseen(const TestRoom& room, PointLight::Visibility visibility, float times) {
  Illumination light = room.illumination();
  PointLight& lamp = light.lights.at(1);
  lamp.lamp_tag = 0;
  lamp.visibility = visibility;
  lamp.distance_known = true;
  lamp.position_m = desk_lamp().position;
  lamp.radius_m = desk_lamp().radius;
  lamp.distance_log_sigma = 0.01f;
  lamp.power_log_sigma = times > 0 ? kConfiguredSigma : kUnknownPowerLogSigma;
  lamp.irradiance *= times > 0 ? times : 1e-3f;
  lamp.intensity = lamp.irradiance * (lamp.position_m - room.probe).squaredNorm();
  return light;
}

AlbedoStage::Result solved(const TestRoom& room, const Illumination& light) {
  capture::Session session;
  session.lamps.push_back({.name = "desk", .normal = {}, .intensity = {}});
  AlbedoStage stage{session};
  return stage.solve(room.field(), light);
}

const PointLight* tagged(const AlbedoStage::Result& result) {
  for (const PointLight& light : result.illumination->lights)
    if (light.lamp_tag == 0) return &light;
  return nullptr;
}

TEST(OutOfViewLamps, ShadingDeterminesTheirPower) {
  const TestRoom room = room_with_both();
  for (const float times : {0.0f, 0.3f, 3.0f}) {
    const auto result = solved(room, unseen(room, PointLight::Visibility::outside_view, times));
    const PointLight* lamp = tagged(result);
    ASSERT_TRUE(lamp) << times;
    EXPECT_LT((lamp->position_m - desk_lamp().position).norm(), 1e-5) << times;
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(lamp->intensity[c] / desk_lamp().intensity[c], 1, 0.1) << times;
    EXPECT_LT(lamp->power_log_sigma, 0.3) << times;
    EXPECT_FALSE(lamp->clipped);
    EXPECT_NEAR((result.illumination->lights[0].position_m - bulb().position).norm(), 0, 0.1) << times;
    for (const Vector3f& p : {Vector3f(-0.3f, 0.3f, 0), Vector3f(0.4f, -0.4f, 0)})
      EXPECT_NEAR(albedo_at(*result.albedo, p).first.x(), 0.5, 0.05) << times;
  }
}

TEST(OutOfViewLamps, LampThatIsOffIsRemovedDespiteItsConfiguredPower) {
  TestRoom room = room_with_both();
  const Illumination light = unseen(room, PointLight::Visibility::outside_view, 1);
  room.lamps.pop_back();
  const auto result = solved(room, light);
  EXPECT_FALSE(tagged(result));
  EXPECT_TRUE(result.warnings.empty()) << result.warnings[0];
}

TEST(OutOfViewLamps, LampSwitchedOnIsFoundWithinTwoSolutions) {
  TestRoom room = room_with_both(), dark = room;
  dark.lamps.pop_back();
  const Illumination light = unseen(room, PointLight::Visibility::outside_view, 0);
  capture::Session session;
  session.lamps.push_back({.name = "desk", .normal = {}, .intensity = {}});
  AlbedoStage stage{session};
  DistanceField field = dark.field();
  EXPECT_FALSE(tagged(stage.solve(field, light)));
  field = room.field();
  AlbedoStage::Result result;
  for (std::uint64_t version = 2; version < 4; ++version) {
    field.version = version;
    result = stage.solve(field, light);
  }
  ASSERT_TRUE(tagged(result));
  EXPECT_NEAR(tagged(result)->intensity.y() / desk_lamp().intensity.y(), 1, 0.15);
}

TEST(OutOfViewLamps, DarkLampInViewIsOffUnlessOccluded) {
  TestRoom room = room_with_both();
  EXPECT_FALSE(tagged(solved(room, unseen(room, PointLight::Visibility::dark, 0))));
  // A box between the two occludes the lamp from the fish-eye.
  room.boxes.push_back({{-0.32f, 0.13f, 0.0f}, {-0.22f, 0.19f, 0.3f}});
  const auto hidden = solved(room, unseen(room, PointLight::Visibility::dark, 0));
  ASSERT_TRUE(tagged(hidden));
  EXPECT_NEAR(tagged(hidden)->intensity.y() / desk_lamp().intensity.y(), 1, 0.15);
  EXPECT_GT(lamp_irradiance(*tagged(hidden), Vector3f::Zero(), Vector3f::UnitZ()).minCoeff(), 0) << "it shines";
}

TEST(OutOfViewLamps, LampWithoutObservedEffectKeepsTheConfiguredPower) {
  TestRoom room = room_with_both();
  room.lamps[1].position = {-0.35f, 0.3f, -0.4f};  // below the floor
  Illumination configured = unseen(room, PointLight::Visibility::outside_view, 1);
  configured.lights[1].position_m = room.lamps[1].position;
  const auto result = solved(room, configured);
  ASSERT_TRUE(tagged(result));
  EXPECT_EQ(tagged(result)->irradiance, configured.lights[1].irradiance);
  configured.lights[1].power_log_sigma = kUnknownPowerLogSigma;
  const auto unknown = solved(room, configured);
  EXPECT_FALSE(tagged(unknown));
  ASSERT_EQ(unknown.warnings.size(), 1u);
  EXPECT_NE(unknown.warnings[0].find("lamp desk: neither the fish-eye nor the shading determines its power"),
            std::string::npos);
}

// The power of a clipped lamp follows from its falloff, which depends on its position.
TEST(TaggedLamps, ClippedLampGetsItsPowerFromShading) {
  TestRoom room;
  room.lamps = {bulb()};
  room.ambient = Vector3f::Constant(0.02f);
  room.boxes = {{{0.05f, -0.1f, 0.0f}, {0.15f, 0.05f, 0.15f}}};
  Illumination light = room.illumination();
  PointLight& lamp = light.lights[0];
  const Vector3f truth = lamp.irradiance;
  lamp.irradiance /= 30;
  lamp.clipped = true;
  lamp.lamp_tag = 0;
  lamp.distance_known = true;
  lamp.position_m = bulb().position;
  lamp.distance_log_sigma = 0.01f;
  const auto result = solved(room, light);
  ASSERT_TRUE(tagged(result));
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(tagged(result)->irradiance[c] / truth[c], 1, 0.15);
  EXPECT_LT((tagged(result)->position_m - bulb().position).norm(), 1e-5);
}

// A lamp with a tag has the tag's position, and its normal if it is flat.
TEST(TaggedLamps, DistanceAndNormalAreTheTags) {
  TestRoom room;
  room.lamps = {bulb()};
  room.ambient = Vector3f::Constant(0.02f);
  Illumination light = room.illumination();
  PointLight& lamp = light.lights[0];
  lamp.lamp_tag = 0;
  lamp.distance_known = true;
  lamp.position_m = room.probe + 1.2f * (bulb().position - room.probe);  // even where it is wrong
  lamp.distance_log_sigma = 0.02f;
  const auto result = solved(room, light);
  ASSERT_TRUE(tagged(result));
  EXPECT_TRUE(tagged(result)->distance_known);
  EXPECT_LT((tagged(result)->position_m - lamp.position_m).norm(), 1e-5);
  EXPECT_EQ(tagged(result)->distance_log_sigma, 0.02f);
  EXPECT_EQ(tagged(result)->irradiance, lamp.irradiance);
  EXPECT_TRUE(tagged(result)->intensity.isApprox(lamp.irradiance * (lamp.position_m - room.probe).squaredNorm()));
  lamp.flat = true;
  lamp.normal = Vector3f(-0.5f, 0, -1).normalized();
  light.version = 2;
  const auto panel = solved(room, light);
  EXPECT_TRUE(tagged(panel)->flat);
  EXPECT_EQ(tagged(panel)->normal, lamp.normal);
}

}  // namespace
}  // namespace lumigraft::reconstruct
