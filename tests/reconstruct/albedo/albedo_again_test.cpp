// Repeated solutions of one room: what they keep and what they update.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <memory>

#include "reconstruct/albedo/albedo.h"
#include "tests/reconstruct/albedo/albedo_room.h"

namespace lumigraft::reconstruct {
namespace {

TestRoom room_with_lamp() {
  TestRoom room;
  room.lamps = {{{0.4f, -0.5f, 0.9f}, {1.2f, 1.0f, 0.8f}, 0.04f}};
  room.ambient = Eigen::Vector3f::Constant(0.02f);
  return room;
}

std::size_t kept(const AlbedoField& a, const AlbedoField& b) {
  std::size_t count = 0;
  for (const auto& [key, brick] : a.bricks) {
    const auto found = b.bricks.find(key);
    count += found != b.bricks.end() && found->second == brick;
  }
  return count;
}

TEST(RepeatedSolutions, UnchangedRoomKeepsItsBricks) {
  TestRoom room = room_with_lamp();
  AlbedoStage stage{capture::Session()};
  const auto first = stage.solve(room.field(), room.illumination());
  // Radiance changes by less than is visible.
  room.albedo = [](const Eigen::Vector3f&) { return Eigen::Vector3f(0.501f, 0.401f, 0.301f); };
  DistanceField field = room.field();
  field.version = 2;
  const auto second = stage.solve(field, room.illumination());
  EXPECT_EQ(kept(*first.albedo, *second.albedo), first.albedo->bricks.size());
  EXPECT_EQ(first.illumination->lights[0].position_m, second.illumination->lights[0].position_m);

  // Invisible steps accumulate and are not lost.
  for (int i = 3; i < 60; ++i) {
    const float more = 1 + 0.005f * static_cast<float>(std::min(i, 40));
    room.albedo = [more](const Eigen::Vector3f&) -> Eigen::Vector3f {
      return more * Eigen::Vector3f(0.5f, 0.4f, 0.3f);
    };
    field = room.field();
    field.version = static_cast<std::uint64_t>(i);
    const auto last = stage.solve(field, room.illumination());
    if (i < 59) continue;
    const auto [albedo, sigma] = albedo_at(*last.albedo, {-0.1f, -0.2f, 0});
    EXPECT_GT(sigma, 0);
    EXPECT_NEAR(albedo.x(), 0.6f, 0.02f);
  }
}

TEST(RepeatedSolutions, MovedLampIsFoundAgain) {
  TestRoom room = room_with_lamp();
  AlbedoStage stage{capture::Session()};
  stage.solve(room.field(), room.illumination());
  room.lamps[0].position = {0.1f, -0.6f, 1.0f};
  DistanceField field = room.field();
  field.version = 2;
  Illumination illumination = room.illumination();
  illumination.version = 2;
  const auto again = stage.solve(field, illumination);
  ASSERT_EQ(again.illumination->lights.size(), 1u);
  ASSERT_TRUE(again.illumination->lights[0].distance_known);
  EXPECT_LT((again.illumination->lights[0].position_m - room.lamps[0].position).norm(), 0.12f);
}

/// The room measured `times` as often, its floor bent by `bend_per_m`: height over the square of the distance.
DistanceField measured(DistanceField field, float times, float bend_per_m) {
  for (const BrickKey& key : sorted_keys(field.bricks)) {
    auto brick = std::make_shared<FieldBrick>(*field.brick(key));
    for (int i = 0; i < kBrickVoxels; ++i) {
      const Eigen::Vector3f p = field.voxel_m * voxel_in(key, i).cast<float>();
      brick->distance_m[static_cast<std::size_t>(i)] -= bend_per_m * p.head<2>().squaredNorm();
      brick->weight[static_cast<std::size_t>(i)] *= times;
    }
    field.bricks[key] = brick;
  }
  return field;
}

/// Where lamps seem to be on surface that is known badly must neither stay nor weigh much.
TEST(RepeatedSolutions, LampsAreFoundAgainOnceTheirRoomIsMeasuredBetter) {
  TestRoom room = room_with_lamp();
  const auto lamp_m = [](const AlbedoStage::Result& result) { return result.illumination->lights.at(0).position_m; };
  AlbedoStage stage{capture::Session()}, fresh{capture::Session()};
  const Eigen::Vector3f first_m = lamp_m(stage.solve(measured(room.field(), 1, 0.04f), room.illumination()));
  DistanceField better = measured(room.field(), 8, 0);
  better.version = 2;
  const Eigen::Vector3f last_m = lamp_m(fresh.solve(better, room.illumination()));
  const Eigen::Vector3f again_m = lamp_m(stage.solve(better, room.illumination()));
  EXPECT_LT((again_m - last_m).norm(), 0.3f * (first_m - last_m).norm());
}

TEST(RepeatedSolutions, ChangedColourIsDetected) {
  TestRoom room = room_with_lamp();
  AlbedoStage stage{capture::Session()};
  stage.solve(room.field(), room.illumination());
  room.albedo = [](const Eigen::Vector3f& p) {
    return p.x() > 0.1f ? Eigen::Vector3f(0.2f, 0.3f, 0.6f) : Eigen::Vector3f(0.5f, 0.4f, 0.3f);
  };
  DistanceField field = room.field();
  field.version = 2;
  const auto again = stage.solve(field, room.illumination());
  const auto [albedo, sigma] = albedo_at(*again.albedo, {0.3f, 0.1f, 0});
  EXPECT_GT(sigma, 0);
  EXPECT_LT((albedo - Eigen::Vector3f(0.2f, 0.3f, 0.6f)).norm(), 0.04f);
}

}  // namespace
}  // namespace lumigraft::reconstruct
