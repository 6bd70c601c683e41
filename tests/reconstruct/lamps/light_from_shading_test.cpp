// Light from shading and shadows alone, in rooms whose radiance is known in closed form.
#include "reconstruct/lamps/light_from_shading.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>

#include "reconstruct/math/tag_family.h"
#include "tests/reconstruct/albedo/albedo_room.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

constexpr float kDirection_rad = 0.26f;  // 15°: between directions that the search tries there are 13°
constexpr float kPowerLog = 0.3f;        // as wide as half the uncertainty that is reported
constexpr float kAmbientLog = 0.45f;     // the test room's uniform light passes through the boxes
constexpr float kPaper = 0.8f, kBlack = 0.05f;

capture::Session session_with_tag() {
  capture::Session session;
  session.tag.size_m = 0.16;
  return session;
}

/// Wood around a tag: a checker of paper and black, as coarse as a tag's print.
Vector3f wood_and_tag(const Vector3f& p) {
  const float print_m = static_cast<float>(print_edge_m(session_with_tag().tag)), cell_m = print_m / 5;
  const Vector3f from_corner = p + Vector3f::Constant(0.5f * print_m);
  if (std::abs(p.x()) < 0.5f * print_m && std::abs(p.y()) < 0.5f * print_m && std::abs(p.z()) < 0.01f) {
    const int sum = static_cast<int>(from_corner.x() / cell_m) + static_cast<int>(from_corner.y() / cell_m);
    return Vector3f::Constant(sum % 2 == 0 ? kPaper : kBlack);
  }
  return {0.5f, 0.4f, 0.3f};
}

/// A table with two boxes whose shadows show the lamps.
TestRoom table() {
  TestRoom room;
  room.boxes = {{{0.2f, 0.15f, 0.0f}, {0.3f, 0.25f, 0.15f}}, {{-0.35f, -0.3f, 0.0f}, {-0.2f, -0.2f, 0.1f}}};
  room.ambient = Vector3f::Constant(0.06f);
  room.albedo = wood_and_tag;
  return room;
}

Vector3f irradiance_at(const TestLamp& lamp, const Vector3f& probe) {
  return lamp.irradiance(probe, (lamp.position - probe).normalized());
}

void expect_lamp(const PointLight& found, const TestLamp& lamp, const Vector3f& probe) {
  const Vector3f offset = lamp.position - probe;
  EXPECT_LT(angle_between(found.direction, offset.normalized()), kDirection_rad) << found.direction.transpose();
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(std::log(found.irradiance[c] / irradiance_at(lamp, probe)[c]), 0, kPowerLog) << "channel " << c;
  EXPECT_NEAR(std::log((found.position_m - probe).norm() / offset.norm()), 0, 2 * found.distance_log_sigma);
  EXPECT_TRUE(found.distance_known);
  EXPECT_GT(found.power_log_sigma, 0.3);
  EXPECT_LT(found.id, 0);
}

Vector3f zenith(const Illumination& light) { return light.environment.sample(Vector3f::UnitZ()); }

TEST(LightFromShading, FindsTheLampWhoseShadowsItSees) {
  for (const Vector3f& at : {Vector3f(-0.5f, 0.4f, 0.9f), Vector3f(0.9f, -0.2f, 0.6f), Vector3f(0.1f, 0.3f, 1.4f)}) {
    TestRoom room = table();
    room.lamps = {{at, at.squaredNorm() * Vector3f(1.2f, 1.0f, 0.7f)}};
    const auto light = LightFromShading(session_with_tag()).estimate(room.field());
    ASSERT_TRUE(light) << at.transpose();
    EXPECT_TRUE(light->from_shading);
    ASSERT_EQ(light->lights.size(), 1u) << at.transpose();
    expect_lamp(light->lights[0], room.lamps[0], light->probe_position_m);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(std::log(zenith(*light)[c] / room.ambient[c]), 0, kAmbientLog);
  }
}

TEST(LightFromShading, TellsTwoLampsOfDifferentColourApart) {
  TestRoom room = table();
  room.lamps = {{{-0.6f, -0.3f, 0.9f}, {1.2f, 0.9f, 0.6f}}, {{0.8f, 0.5f, 0.9f}, {0.5f, 0.7f, 0.9f}}};
  const auto light = LightFromShading(session_with_tag()).estimate(room.field());
  ASSERT_TRUE(light);
  ASSERT_EQ(light->lights.size(), 2u);
  const Vector3f& probe = light->probe_position_m;
  EXPECT_GT(light->lights[0].irradiance.sum(), light->lights[1].irradiance.sum()) << "strongest first";
  expect_lamp(light->lights[0], room.lamps[0], probe);
  expect_lamp(light->lights[1], room.lamps[1], probe);
}

/// The texture could be taken for shading.
TEST(LightFromShading, UniformLightHasNoLamp) {
  TestRoom room = table();
  room.boxes.clear();
  room.ambient = {0.3f, 0.25f, 0.2f};
  room.albedo = [](const Vector3f& p) -> Vector3f {
    const float texture = 1 + 0.2f * std::sin(9 * p.x()) * std::sin(7 * p.y() + 1);
    return p.head<2>().norm() < 0.15f ? wood_and_tag(p) : (texture * wood_and_tag(p)).eval();
  };
  const auto light = LightFromShading(session_with_tag()).estimate(room.field());
  ASSERT_TRUE(light);
  EXPECT_TRUE(light->lights.empty());
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(zenith(*light)[c] / room.ambient[c], 1, 0.1);
}

/// Without paper the level follows from the albedo of an average room.
TEST(LightFromShading, WithoutPaperSurfacesAreOfTypicalAlbedo) {
  TestRoom room = table();
  room.boxes.clear();
  room.ambient = Vector3f::Constant(0.3f);
  room.albedo = [](const Vector3f&) { return Vector3f::Constant(0.7f); };
  const auto light = LightFromShading(session_with_tag()).estimate(room.field());
  ASSERT_TRUE(light);
  EXPECT_NEAR(zenith(*light).y() / (0.3f * 0.7f / 0.35f), 1, 0.05);
}

/// Where a lamp would hide surface that a camera saw, there is none.
TEST(LightFromShading, NoLampIsWhereACameraSawThrough) {
  TestRoom room = table();
  const Vector3f at(0.3f, -0.5f, 0.7f), camera(0.3f, -0.9f, 1.26f);
  room.lamps = {{at, {1, 1, 1}}};
  DistanceField field = room.field();
  const auto distance_from = [&](const Illumination& light) { return (light.lights.at(0).position_m - at).norm(); };
  const auto free = LightFromShading(session_with_tag()).estimate(field);
  EXPECT_LT(distance_from(*free), 0.3f);
  for (int i = 0; i < 9; ++i)
    for (int k = 0; k < 9; ++k)
      field.seen_from_m.push_back(camera + 0.15f * Vector3f(static_cast<float>(i) - 4, 0, static_cast<float>(k) - 4));
  const auto seen = LightFromShading(session_with_tag()).estimate(field);
  EXPECT_TRUE(seen->lights.empty() || distance_from(*seen) > 0.3f);
}

TEST(LightFromShading, IsKeptUntilMuchMoreIsKnown) {
  TestRoom room = table();
  room.lamps = {{{-0.5f, 0.4f, 0.9f}, {1, 1, 1}}};
  LightFromShading stage(session_with_tag());
  EXPECT_FALSE(stage.estimate(DistanceField())) << "no surface is known";
  const auto first = stage.estimate(room.field());
  ASSERT_TRUE(first);
  room.half_m = 0.65f;
  EXPECT_EQ(stage.estimate(room.field()), first);
  room.half_m = 1;
  const auto later = stage.estimate(room.field());
  EXPECT_NE(later, first);
  EXPECT_GT(later->version, first->version);
}

TEST(LightFromShading, BlackPicturesGiveDimLightWithoutLamps) {
  TestRoom room = table();
  room.ambient.setZero();
  const auto light = LightFromShading(session_with_tag()).estimate(room.field());
  ASSERT_TRUE(light);
  EXPECT_TRUE(light->lights.empty());
  for (const float radiance : light->environment.radiance.data) {
    ASSERT_TRUE(std::isfinite(radiance));
    ASSERT_LT(radiance, 1e-3f);
  }
}

}  // namespace
}  // namespace lumigraft::reconstruct
