// Light that the room reflects although the fish-eye does not see its lamp.
#include "reconstruct/albedo/missing_light.h"

#include <gtest/gtest.h>

#include <cmath>

#include "reconstruct/albedo/albedo.h"
#include "tests/reconstruct/albedo/albedo_room.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

/// A table with a printed tag, lit by a bulb and a little ambient light.
TestRoom table() {
  TestRoom room;
  room.lamps = {{{0.4f, -0.3f, 0.9f}, {1.2f, 1.1f, 0.9f}, 0.03f}};
  room.ambient = Vector3f::Constant(0.03f);
  room.albedo = [](const Vector3f& p) -> Vector3f {
    const bool black = (static_cast<int>(std::floor(p.x() / 0.04f)) + static_cast<int>(std::floor(p.y() / 0.04f))) % 2;
    if (std::abs(p.x()) < 0.1f && std::abs(p.y()) < 0.1f) return Vector3f::Constant(black ? 0.04f : 0.8f);
    return {0.3f, 0.25f, 0.2f};
  };
  return room;
}

bool is_missing(const TestRoom& room, const Illumination& seen, double tag_m) {
  capture::Session session;
  session.tag.size_m = tag_m;
  AlbedoStage stage{session};
  return stage.solve(room.field(), seen).light_is_missing;
}

TEST(MissingLight, OfALampThatTheFisheyeDoesNotSee) {
  const TestRoom room = table();
  Illumination seen = room.illumination();
  for (const double tag_m : {0.16, 0.0}) EXPECT_FALSE(is_missing(room, seen, tag_m)) << tag_m;
  seen.lights.clear();
  for (const double tag_m : {0.16, 0.0}) EXPECT_TRUE(is_missing(room, seen, tag_m)) << tag_m;
}

TEST(MissingLight, NotOfAClippedLampNorOfCamerasThatDisagree) {
  const TestRoom room = table();
  Illumination clipped = room.illumination();
  clipped.lights[0].irradiance = Vector3f::Constant(clipped.lights[0].irradiance.mean() / 6);
  clipped.lights[0].clipped = true;
  EXPECT_FALSE(is_missing(room, clipped, 0.16));
  Illumination darker = room.illumination();
  darker.lights[0].irradiance *= 0.6f;
  for (float& radiance : darker.environment.radiance.data) radiance *= 0.6f;
  EXPECT_FALSE(is_missing(room, darker, 0.16));
}

// Light from shading is complete by its scale: nothing would be gained by another estimate.
TEST(MissingLight, NotInLightThatWasEstimatedFromShading) {
  const TestRoom room = table();
  Illumination guessed = room.illumination();
  guessed.lights.clear();
  guessed.from_shading = true;
  EXPECT_FALSE(is_missing(room, guessed, 0.16));
}

}  // namespace
}  // namespace lumigraft::reconstruct
