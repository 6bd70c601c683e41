#include "server/pipeline/albedo_schedule.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

namespace lumigraft::server {
namespace {

reconstruct::Illumination one_lamp(std::uint64_t version, float irradiance) {
  reconstruct::Illumination light;
  light.version = version;
  reconstruct::PointLight lamp;
  lamp.id = 1;
  lamp.direction = Eigen::Vector3f::UnitZ();
  lamp.irradiance.setConstant(irradiance);
  light.lights.push_back(lamp);
  return light;
}

/// A row of so many bricks.
reconstruct::DistanceField room(int bricks, std::uint64_t version) {
  static const auto grey = [] {
    auto brick = std::make_shared<reconstruct::FieldBrick>();
    brick->radiance.fill(Eigen::Vector3f::Constant(0.5f));
    brick->radiance_weight.fill(1);
    return brick;
  }();
  reconstruct::DistanceField field;
  field.version = version;
  for (int i = 0; i < bricks; ++i) field.bricks[{i, 0, 0}] = grey;
  return field;
}

std::shared_ptr<const reconstruct::DistanceField> shared(const reconstruct::DistanceField& field) {
  return std::make_shared<const reconstruct::DistanceField>(field);
}

std::shared_ptr<const reconstruct::AlbedoField> albedo_of(float value, float sigma) {
  auto field = std::make_shared<reconstruct::AlbedoField>();
  auto brick = std::make_shared<reconstruct::AlbedoBrick>();
  brick->albedo.fill(Eigen::Vector3f::Constant(value));
  brick->sigma.fill(sigma);
  field->bricks[{0, 0, 0}] = brick;
  return field;
}

/// On which of so many frames it is solved, of a field that noise alone changes.
template <typename Solve>
std::string frames_solved(AlbedoSchedule& schedule, reconstruct::DistanceField field, int frames, Solve solve) {
  std::string when;
  for (int frame = 0; frame < frames; ++frame) {
    ++field.version;
    if (!schedule.due(field, one_lamp(1, 10))) continue;
    schedule.begin(shared(field), one_lamp(1, 10));
    schedule.solved(solve(frame));
    when += std::to_string(frame) + " ";
  }
  return when;
}

TEST(AlbedoSchedule, OnTheFirstFrameThenEveryEighthOrWhenMuchChanged) {
  AlbedoSchedule schedule;
  reconstruct::DistanceField field = room(1, 1);
  const auto learns = [](int frame) { return albedo_of(0.5f, 0.1f / static_cast<float>(1 + frame)); };
  EXPECT_EQ(frames_solved(schedule, field, 20, learns), "0 8 16 ");
  EXPECT_FALSE(schedule.due(field, one_lamp(2, 11)));
  EXPECT_TRUE(schedule.due(field, one_lamp(2, 13))) << "a third more light";
  reconstruct::Illumination turned = one_lamp(2, 10);
  turned.lights[0].direction = Eigen::Vector3f::UnitY();
  EXPECT_TRUE(schedule.due(field, turned)) << "from elsewhere";
  EXPECT_TRUE(schedule.due(room(2, 2), one_lamp(2, 10))) << "twice the room";
}

TEST(AlbedoSchedule, WhatTellsNothingNewIsSolvedMoreSeldom) {
  AlbedoSchedule schedule;
  const auto same = [](int) { return albedo_of(0.5f, 0.02f); };
  EXPECT_EQ(frames_solved(schedule, room(100, 1), 200, same), "0 8 24 56 120 184 ");
  EXPECT_EQ(schedule.patience(), AlbedoSchedule::kMostPatience);
}

TEST(AlbedoSchedule, OtherAlbedoEndsThePatience) {
  AlbedoSchedule schedule;
  const auto changes = [](int frame) { return albedo_of(frame < 50 ? 0.5f : 0.51f, 0.02f); };
  EXPECT_EQ(frames_solved(schedule, room(100, 1), 90, changes), "0 8 24 56 64 80 ");
}

TEST(AlbedoSchedule, WhatMovesIsSolvedAtTheUsualPace) {
  AlbedoSchedule schedule;
  const auto same = [](int) { return albedo_of(0.5f, 0.02f); };
  frames_solved(schedule, room(100, 1), 60, same);
  reconstruct::DistanceField field = room(100, 1000);
  auto noisy = std::make_shared<reconstruct::FieldBrick>(*field.bricks.at({0, 0, 0}));
  noisy->radiance.fill(Eigen::Vector3f::Constant(0.49f));
  field.bricks[{0, 0, 0}] = noisy;
  EXPECT_FALSE(schedule.moved(field, one_lamp(2, 10))) << "2 % is noise";
  auto other = std::make_shared<reconstruct::FieldBrick>(*noisy);
  other->radiance.fill(Eigen::Vector3f::Constant(0.4f));
  field.bricks[{0, 0, 0}] = other;
  EXPECT_TRUE(schedule.moved(field, one_lamp(2, 10)));
  EXPECT_TRUE(schedule.moved(room(100, 2), one_lamp(2, 10.2f))) << "2 % of the light";
  EXPECT_TRUE(schedule.moved(room(101, 2), one_lamp(2, 10))) << "a brick more";
  int frames = 0;
  while (!schedule.due(field, one_lamp(1, 10))) ++frames;
  EXPECT_LE(frames, AlbedoSchedule::kFrames);
}

TEST(AlbedoSchedule, NothingNewIsNotSolvedAgain) {
  const reconstruct::DistanceField field;
  AlbedoSchedule schedule;
  EXPECT_TRUE(schedule.due(field, one_lamp(1, 1)));
  schedule.begin(shared(field), one_lamp(1, 1));
  schedule.solved(nullptr);
  for (int frame = 0; frame < 30; ++frame) {
    EXPECT_FALSE(schedule.due(field, one_lamp(1, 1)));
  }
}

}  // namespace
}  // namespace lumigraft::server
