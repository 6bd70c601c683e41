#include "reconstruct/shading/irradiance.h"

#include <gtest/gtest.h>

#include <cmath>

#include "reconstruct/light/environment.h"
#include "tests/reconstruct/albedo/albedo_room.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

constexpr int kRays = 1024;
constexpr float kFloor = 0.35f;  ///< albedo of unseen floors
const Vector3f kPlace(0.5f, 0, 0.3f), kOut(-1, 0, 0);

/// A wall under a white sky. A camera saw its face towards -x, but not the floor.
TestRoom wall() {
  TestRoom room;
  room.ambient = Vector3f::Ones();
  room.boxes = {{{0.5f, -0.55f, -0.1f}, {0.7f, 0.55f, 0.55f}}};
  room.seen = [](const Vector3f& p) { return p.x() < 0.55f && p.x() > 0.46f && p.z() > 0.04f; };
  return room;
}

/// The sky in a fish-eye that looks up; the unseen lower half is filled with the same radiance.
Illumination seen_above(const TestRoom& room) {
  Illumination light = room.illumination();
  light.environment.seen = capture::Image<std::uint8_t>(128, 64, 1, 1);
  for (int v = 32; v < 64; ++v)
    for (int u = 0; u < 128; ++u) light.environment.seen.at(u, v) = 0;
  return light;
}

// n lamps with independent errors of their visibility ~ 1/√rays: their sum has the error of two lamps, at most.
TEST(IrradianceModel, RaysFollowALampsShareOfTheLight) {
  constexpr int kEnough = 8;
  for (const int lamps : {2, 3, 4, 8, 16}) {
    const float share = 1 / static_cast<float>(lamps);
    const int rays = IrradianceModel::rays_for(share, kEnough);
    EXPECT_LE(static_cast<float>(lamps) * share * share / static_cast<float>(rays), 2 * 0.25f / kEnough + 1e-6f);
    EXPECT_LE(lamps * rays, 2 * kEnough + lamps) << "the number of rays does not grow with that of lamps";
  }
  EXPECT_EQ(IrradianceModel::rays_for(1, kEnough), kEnough);
  EXPECT_EQ(IrradianceModel::rays_for(0, kEnough), 1);
}

TEST(IrradianceModel, UnseenFloorReflectsTheSky) {
  const TestRoom room = wall();
  const DistanceField field = room.field();
  const FieldRays rays(field);
  const MetalMask metal{capture::Session()};
  const IrradianceModel all(field, rays, metal, room.illumination());
  EXPECT_NEAR(all.gather(kPlace, kOut, kRays).irradiance.y() / kTestPi, 1, 0.01);
  EXPECT_TRUE(all.gather(kPlace, kOut, kRays).floor_hits.empty());

  const Illumination above = seen_above(room);
  const IrradianceModel light(field, rays, metal, above);
  const IrradianceModel::Gathered gathered = light.gather(kPlace, kOut, kRays);
  EXPECT_NEAR(gathered.irradiance.y() / (0.5f * kTestPi * (1 + kFloor)), 1, 0.02);
  EXPECT_EQ(light.irradiance_from_floor(gathered, light.lamp_irradiance_on_floor({})), Vector3f::Zero());
}

// Light of a lamp from the floor against numerical integration over squares of 1 cm.
TEST(IrradianceModel, UnseenFloorReflectsLamps) {
  TestRoom room = wall();
  room.lamps = {{{-0.3f, 0.2f, 0.9f}, {2, 1, 0.5f}, 0.04f}};
  const Illumination above = seen_above(room);
  const DistanceField field = room.field();
  const FieldRays rays(field);
  const MetalMask metal{capture::Session()};
  const IrradianceModel light(field, rays, metal, above);
  std::vector<PointLight> lamps = above.lights;
  lamps[0].distance_known = true;
  lamps[0].position_m = room.lamps[0].position;

  const float height = 0.05f;  // lowest known surface
  double sum = 0;
  for (float x = -4; x < 0.5f; x += 0.01f) {
    for (float y = -4; y < 4; y += 0.01f) {
      const Vector3f on(x + 0.005f, y + 0.005f, height), way = kPlace - on, to_lamp = room.lamps[0].position - on;
      const float irradiance = to_lamp.normalized().z() / to_lamp.squaredNorm();
      const Vector3f towards = way.normalized();
      sum += 1e-4 * kFloor / kTestPi * irradiance * towards.z() * -kOut.dot(towards) / way.squaredNorm();
    }
  }
  const Vector3f found =
      light.irradiance_from_floor(light.gather(kPlace, kOut, kRays), light.lamp_irradiance_on_floor(lamps));
  EXPECT_NEAR(found.y() / sum, 1, 0.08);  // the height of the floor is known to a voxel
  EXPECT_NEAR(found.x() / found.y(), 2, 1e-3);
}

/// A room of six sides, one of them bright.
Enclosure bright_room(bool measured) {
  Enclosure room;
  room.sides = {{{1, 0, 0}, 1, measured},     {{-1, 0, 0}, 1, measured}, {{0, 1, 0}, 1.2f, measured},
                {{0, -1, 0}, 1.4f, measured}, {{0, 0, 1}, 0, measured},  {{0, 0, -1}, 2, measured}};
  return room;
}

float bright(const Enclosure& room, const Vector3f& from, const Vector3f& direction) {
  return room.leave(from, direction)->side == 0 ? 1.0f : 0.1f;
}

TEST(IrradianceModel, EnvironmentIsLookedUpOnTheEnclosure) {
  const Enclosure room = bright_room(true), guess = bright_room(false);
  Illumination light;
  light.probe_position_m = {0.3f, 0.1f, 0.03f};
  light.environment.radiance = capture::Image<float>(128, 64, 3);
  light.environment.seen = capture::Image<std::uint8_t>(128, 64, 1, 1);
  for (int v = 0; v < 64; ++v)
    for (int u = 0; u < 128; ++u)
      for (int c = 0; c < 3; ++c)
        light.environment.radiance.at(u, v, c) =
            bright(room, light.probe_position_m, environment_direction(u, v, 128, 64));
  const DistanceField nothing;
  const FieldRays rays(nothing);
  const MetalMask metal{capture::Session()};
  const Vector3f place(-0.8f, 0.5f, 0.02f), up = Vector3f::UnitZ();

  double exact = 0;
  constexpr int kSteps = 400;
  for (int i = 0; i < kSteps; ++i) {
    for (int j = 0; j < kSteps; ++j) {
      const float sine = std::sqrt((i + 0.5f) / kSteps), phi = 2 * kTestPi * (j + 0.5f) / kSteps;
      const Vector3f direction(sine * std::cos(phi), sine * std::sin(phi), std::sqrt(1 - sine * sine));
      exact += kTestPi * bright(room, place, direction) / (kSteps * kSteps);
    }
  }
  const auto irradiance = [&](const Enclosure* enclosure) {
    return IrradianceModel(nothing, rays, metal, light, enclosure).gather(place, up, kRays).irradiance.x();
  };
  EXPECT_NEAR(irradiance(&room) / exact, 1, 0.03);
  const float far = irradiance(nullptr);
  EXPECT_LT(far / exact, 0.6);
  EXPECT_EQ(irradiance(&guess), far);  // without a measured corner guessed sides do not count
  Enclosure corner = guess;
  corner.sides[2].measured = corner.sides[4].measured = true;
  const float half = 0.5f * (far + irradiance(&room));
  EXPECT_NEAR(irradiance(&corner), half, 0.02f * half);  // guessed sides count half
}

}  // namespace
}  // namespace lumigraft::reconstruct
