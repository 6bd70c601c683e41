// Lamps that move, dim or go, on surface whose albedo is known.
#include <gtest/gtest.h>

#include <cmath>

#include "reconstruct/albedo/albedo.h"
#include "tests/reconstruct/albedo/albedo_room.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

/// A floor painted in stripes, with a box and two bulbs.
TestRoom striped_room() {
  TestRoom room;
  room.boxes = {{{0.2f, 0.1f, 0.0f}, {0.3f, 0.2f, 0.12f}}};
  room.lamps = {{{0.5f, -0.3f, 0.9f}, {2, 2, 2}, 0.03f}, {{-0.7f, 0.4f, 1.2f}, {1, 1.2f, 1.5f}, 0.03f}};
  room.ambient = Vector3f::Constant(0.05f);
  room.albedo = [](const Vector3f& p) { return Vector3f::Constant(0.45f + 0.2f * std::sin(30 * p.x())).eval(); };
  return room;
}

struct Moment {
  DistanceField field;
  Illumination light;
};
Moment moment(const TestRoom& room, std::uint64_t version) {
  Moment result{room.field(), room.illumination()};
  result.field.version = result.light.version = version;
  return result;
}
float distance_error(const AlbedoStage::Result& result, const TestRoom& room, std::size_t lamp) {
  const PointLight* found = lamp_with_id(result.illumination->lights, static_cast<int>(lamp));
  if (!found || !found->distance_known) return INFINITY;
  return (found->position_m - room.lamps[lamp].position).norm() / (room.lamps[lamp].position - room.probe).norm();
}

TEST(FollowLight, CarriedLampKeepsItsDistanceAndAlbedoStays) {
  TestRoom room = striped_room();
  AlbedoStage stage{capture::Session()};
  const Moment first = moment(room, 1);
  const AlbedoStage::Result solved = stage.solve_complete(first.field, first.light);
  EXPECT_FALSE(stage.follow_light(first.field, first.light)) << "the light is as before";
  for (int step = 1; step <= 5; ++step) {
    const float angle = 0.25f * static_cast<float>(step), away = 1 + 0.08f * static_cast<float>(step);
    room.lamps[0].position = {0.58f * away * std::cos(angle), -0.58f * away * std::sin(angle), 0.9f * away};
    const Moment now = moment(room, 1 + static_cast<std::uint64_t>(step));
    const auto followed = stage.follow_light(now.field, now.light);
    ASSERT_TRUE(followed) << step;
    EXPECT_LT(distance_error(*followed, room, 0), 0.05f) << step;
    EXPECT_EQ(followed->illumination->lights[1].position_m, solved.illumination->lights[1].position_m);
    EXPECT_EQ(followed->albedo, solved.albedo);
    EXPECT_TRUE(followed->due) << "another light adds information about albedo";
  }
}

// What reflects otherwise under another light, as glossy wood does, looks like a lamp at another distance. Its power is
// known.
TEST(FollowLight, CarriedLampKeepsItsPower) {
  TestRoom room = striped_room();
  AlbedoStage stage{capture::Session()};
  const Moment first = moment(room, 1);
  stage.solve_complete(first.field, first.light);
  const auto albedo = room.albedo;
  room.albedo = [&](const Vector3f& p) -> Vector3f { return (1 + 0.2f * (p.x() + p.y())) * albedo(p); };
  for (int step = 1; step <= 5; ++step) {
    const float angle = 0.25f * static_cast<float>(step);
    room.lamps[0].position = {0.58f * std::cos(angle), -0.58f * std::sin(angle), 0.9f};
    const Moment now = moment(room, 1 + static_cast<std::uint64_t>(step));
    const auto followed = stage.follow_light(now.field, now.light);
    ASSERT_TRUE(followed) << step;
    EXPECT_LT(distance_error(*followed, room, 0), 0.05f) << step;
  }
}

TEST(FollowLight, DimmedLampStaysWhereItIs) {
  TestRoom room = striped_room();
  AlbedoStage stage{capture::Session()};
  const Moment first = moment(room, 1);
  const AlbedoStage::Result solved = stage.solve_complete(first.field, first.light);
  room.lamps[0].intensity *= 0.3f;
  const Moment now = moment(room, 2);
  const auto followed = stage.follow_light(now.field, now.light);
  ASSERT_TRUE(followed);
  EXPECT_EQ(followed->illumination->lights[0].position_m, solved.illumination->lights[0].position_m);
  EXPECT_NEAR(followed->illumination->lights[0].intensity.x() / solved.illumination->lights[0].intensity.x(), 0.3f,
              1e-3);
}

// An error of the strong lamp moves the weak one, which shading hardly determines in its light.
TEST(FollowLight, WhereOthersGoALampIsFoundBetter) {
  TestRoom room = striped_room();
  room.lamps[1].intensity *= 0.4f;
  AlbedoStage stage{capture::Session()};
  Moment first = moment(room, 1);
  first.light.lights[0].irradiance *= 0.9f;  // an error of the fish-eye
  const float before = distance_error(stage.solve_complete(first.field, first.light), room, 1);
  const TestLamp strong = room.lamps[0];
  Moment alone = moment(room, 2);
  room.lamps[0].intensity.setZero();
  alone.field = room.field();
  alone.field.version = 2;
  alone.light.lights.erase(alone.light.lights.begin());
  const auto followed = stage.follow_light(alone.field, alone.light);
  ASSERT_TRUE(followed);
  const float after = distance_error(*followed, room, 1);
  std::printf("error of distance: %.3f with a strong lamp, %.3f alone\n", before, after);
  EXPECT_LT(after, 0.7f * before);

  room.lamps[0] = strong;
  const Moment both = moment(room, 3);
  const auto again = stage.follow_light(both.field, both.light);
  ASSERT_TRUE(again);
  EXPECT_FLOAT_EQ(distance_error(*again, room, 1), after) << "it is not forgotten";
}

TEST(FollowLight, LampThatGoesIsGoneAndANewOneNeedsASearch) {
  TestRoom room = striped_room();
  AlbedoStage stage{capture::Session()};
  const Moment first = moment(room, 1);
  stage.solve_complete(first.field, first.light);
  Moment without = moment(room, 2);
  without.light.lights.pop_back();
  const auto followed = stage.follow_light(without.field, without.light);
  ASSERT_TRUE(followed);
  EXPECT_EQ(followed->illumination->lights.size(), 1u);
  Moment with = moment(room, 3);
  with.light.lights[1].id = 9;
  EXPECT_FALSE(stage.follow_light(with.field, with.light));
}

// Light that was guessed without a fish-eye leaves no prior of albedo to the light that the fish-eye measures later.
TEST(FollowLight, GuessedLightLeavesNoPrior) {
  const TestRoom room = striped_room();
  const Moment now = moment(room, 2);
  Illumination guess = now.light;
  guess.version = 1;
  guess.from_shading = true;
  for (PointLight& lamp : guess.lights) lamp.irradiance *= 0.4f;
  AlbedoStage stage{capture::Session()};
  stage.solve_complete(now.field, guess);
  const AlbedoStage::Result after = stage.solve_complete(now.field, now.light);
  const AlbedoStage::Result fresh = AlbedoStage{capture::Session()}.solve_complete(now.field, now.light);
  for (float x = -0.4f; x < 0.4f; x += 0.1f)
    EXPECT_NEAR(albedo_at(*after.albedo, {x, -0.2f, 0}).first.x(), albedo_at(*fresh.albedo, {x, -0.2f, 0}).first.x(),
                0.02f);
}

// With one lamp after the other at several places the albedo of a solution under all of them is nearer to the truth
// than that under the last alone: its errors are those of each light.
TEST(FollowLight, AlbedoIsLearntFromEveryLight) {
  TestRoom room = striped_room();
  AlbedoStage all{capture::Session()};
  const auto error = [&](const AlbedoStage::Result& result) {
    double sum = 0;
    int count = 0;
    for (float x = -0.4f; x < 0.4f; x += 0.02f) {
      for (float y = -0.4f; y < 0.0f; y += 0.02f) {
        const auto [albedo, sigma] = albedo_at(*result.albedo, {x, y, 0});
        if (sigma < 0) continue;
        sum += std::pow(std::log(albedo.mean() / room.albedo({x, y, 0}).mean()), 2);
        ++count;
      }
    }
    return std::sqrt(sum / count);
  };
  double alone = 0, together = 0;
  for (int step = 0; step < 4; ++step) {
    const float angle = 1.5f * static_cast<float>(step);
    room.lamps[0].position = {0.6f * std::cos(angle), 0.6f * std::sin(angle), 0.9f};
    Moment now = moment(room, 1 + static_cast<std::uint64_t>(step));
    // The fish-eye errs by 15 %, each time otherwise.
    now.light.lights[0].irradiance *= step % 2 ? 1.15f : 0.85f;
    together = error(all.solve_complete(now.field, now.light));
    alone = error(AlbedoStage{capture::Session()}.solve_complete(now.field, now.light));
  }
  std::printf("RMS log error of albedo: %.3f under the last light, %.3f under four\n", alone, together);
  EXPECT_LT(together, 0.8 * alone);
}

}  // namespace
}  // namespace lumigraft::reconstruct
