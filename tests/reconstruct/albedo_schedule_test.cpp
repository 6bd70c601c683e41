#include "reconstruct/albedo_schedule.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>

namespace lumigraft::reconstruct {
namespace {

Illumination one_lamp(std::uint64_t version, float irradiance) {
  Illumination light;
  light.version = version;
  PointLight lamp;
  lamp.id = 1;
  lamp.direction = Eigen::Vector3f::UnitZ();
  lamp.irradiance.setConstant(irradiance);
  light.lights.push_back(lamp);
  return light;
}

/// A row of so many bricks.
DistanceField room(int bricks, std::uint64_t version) {
  static const auto grey = [] {
    auto brick = std::make_shared<FieldBrick>();
    BrickColor& color = brick->own_color();
    color.radiance.fill(Eigen::Vector3f::Constant(0.5f));
    color.weight.fill(1);
    return brick;
  }();
  DistanceField field;
  field.version = version;
  for (int i = 0; i < bricks; ++i) field.bricks[{i, 0, 0}] = grey;
  return field;
}

std::shared_ptr<const DistanceField> shared(const DistanceField& field) {
  return std::make_shared<const DistanceField>(field);
}

std::shared_ptr<const AlbedoField> albedo_of(float value, float sigma) {
  auto field = std::make_shared<AlbedoField>();
  auto brick = std::make_shared<AlbedoBrick>();
  brick->albedo.fill(Eigen::Vector3f::Constant(value));
  brick->sigma.fill(sigma);
  field->bricks[{0, 0, 0}] = brick;
  return field;
}

bool due(AlbedoSchedule& schedule, const DistanceField& field, const Illumination& light) {
  return schedule.next(field, light) != AlbedoWork::nothing;
}

void solve(AlbedoSchedule& schedule, const DistanceField& field, const Illumination& light,
           std::shared_ptr<const AlbedoField> albedo) {
  const AlbedoSchedule::Work work(schedule, AlbedoWork::everything);
  schedule.begin(shared(field), light);
  schedule.solved(std::move(albedo), false);
}

/// On which of so many frames it is solved, of a field that noise alone changes.
template <typename Albedo>
std::string frames_solved(AlbedoSchedule& schedule, DistanceField field, int frames, Albedo albedo) {
  std::string when;
  for (int frame = 0; frame < frames; ++frame) {
    ++field.version;
    if (!due(schedule, field, one_lamp(1, 10))) continue;
    solve(schedule, field, one_lamp(1, 10), albedo(frame));
    when += std::to_string(frame) + " ";
  }
  return when;
}

TEST(AlbedoSchedule, OnTheFirstFrameThenEveryEighthOrWhenMuchChanged) {
  AlbedoSchedule schedule;
  DistanceField field = room(1, 1);
  const auto learns = [](int frame) { return albedo_of(0.5f, 0.1f / static_cast<float>(1 + frame)); };
  EXPECT_EQ(frames_solved(schedule, field, 20, learns), "0 8 16 ");
  EXPECT_FALSE(due(schedule, field, one_lamp(2, 11)));
  EXPECT_TRUE(due(schedule, field, one_lamp(2, 13))) << "a third more light";
  Illumination turned = one_lamp(2, 10);
  turned.lights[0].direction = Eigen::Vector3f::UnitY();
  EXPECT_TRUE(due(schedule, field, turned)) << "from elsewhere";
  EXPECT_TRUE(due(schedule, room(2, 2), one_lamp(2, 10))) << "twice the room";
}

TEST(AlbedoSchedule, WhatTellsNothingNewIsSolvedMoreSeldom) {
  AlbedoSchedule schedule;
  const auto same = [](int) { return albedo_of(0.5f, 0.02f); };
  EXPECT_EQ(frames_solved(schedule, room(100, 1), 200, same), "0 8 24 56 120 184 ");
  EXPECT_EQ(schedule.patience(), AlbedoSchedule::kMaxPatience);
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
  DistanceField field = room(100, 1000);
  auto noisy = std::make_shared<FieldBrick>(*field.bricks.at({0, 0, 0}));
  noisy->own_color().radiance.fill(Eigen::Vector3f::Constant(0.49f));
  field.bricks[{0, 0, 0}] = noisy;
  EXPECT_FALSE(schedule.moved(field, one_lamp(2, 10))) << "2 % is noise";
  auto other = std::make_shared<FieldBrick>(*noisy);
  other->own_color().radiance.fill(Eigen::Vector3f::Constant(0.4f));
  field.bricks[{0, 0, 0}] = other;
  EXPECT_TRUE(schedule.moved(field, one_lamp(2, 10)));
  EXPECT_TRUE(schedule.moved(room(100, 2), one_lamp(2, 10.2f))) << "2 % of the light";
  EXPECT_TRUE(schedule.moved(room(101, 2), one_lamp(2, 10))) << "a brick more";
  int frames = 0;
  while (!due(schedule, field, one_lamp(1, 10))) ++frames;
  EXPECT_LE(frames, FramePace::kFrames);
}

TEST(AlbedoSchedule, NothingNewIsNotSolvedAgain) {
  const DistanceField field;
  AlbedoSchedule schedule;
  EXPECT_TRUE(due(schedule, field, one_lamp(1, 1)));
  solve(schedule, field, one_lamp(1, 1), nullptr);
  for (int frame = 0; frame < 30; ++frame) {
    EXPECT_FALSE(due(schedule, field, one_lamp(1, 1)));
  }
}

/// Solving what is new is never kept waiting, solving everything only as long as `everything_waits`.
struct SplitPace : AlbedoPace {
  explicit SplitPace(const bool& waits) : everything_waits(waits) {}
  bool waited(AlbedoWork work, int, bool) const override { return work != AlbedoWork::everything || !everything_waits; }
  bool may_compare() override { return true; }
  void begin(AlbedoWork) override {}
  const bool& everything_waits;
};

TEST(AlbedoSchedule, EverythingWaitsForItsTimeWhileWhatIsNewIsSolved) {
  bool waits = false;
  AlbedoSchedule schedule(std::make_unique<SplitPace>(waits));
  const auto albedo = albedo_of(0.5f, 0.02f);
  EXPECT_EQ(schedule.next(room(1, 1), one_lamp(1, 10)), AlbedoWork::everything) << "there is nothing to solve anew";
  solve(schedule, room(1, 1), one_lamp(1, 10), albedo);
  waits = true;
  EXPECT_EQ(schedule.next(room(1, 2), one_lamp(1, 10)), AlbedoWork::incremental);
  schedule.begin(shared(room(1, 2)), one_lamp(1, 10));
  schedule.solved(albedo, true);
  EXPECT_EQ(schedule.next(room(1, 3), one_lamp(1, 10)), AlbedoWork::incremental) << "everything is due, and waits";
  waits = false;
  EXPECT_EQ(schedule.next(room(1, 2), one_lamp(1, 10)), AlbedoWork::everything) << "though nothing changed since";
}

TEST(AlbedoSchedule, WhatOnlyEverythingSolvesIsNotTriedAgain) {
  bool waits = false;
  AlbedoSchedule schedule(std::make_unique<SplitPace>(waits));
  EXPECT_EQ(schedule.next(room(1, 1), one_lamp(1, 10)), AlbedoWork::everything);
  solve(schedule, room(1, 1), one_lamp(1, 10), albedo_of(0.5f, 0.02f));
  waits = true;
  EXPECT_EQ(schedule.next(room(1, 2), one_lamp(2, 10)), AlbedoWork::incremental);
  EXPECT_FALSE(schedule.may_solve_everything());
  schedule.begin(shared(room(1, 2)), one_lamp(2, 10));
  schedule.wait_for_everything();
  EXPECT_EQ(schedule.next(room(1, 2), one_lamp(2, 10)), AlbedoWork::nothing);
  waits = false;
  EXPECT_EQ(schedule.next(room(1, 2), one_lamp(2, 10)), AlbedoWork::everything);
}

TEST(AlbedoSchedule, ACarriedLampIsSearchedInEveryFrame) {
  AlbedoSchedule schedule;
  const DistanceField field = room(10, 1);
  for (std::uint64_t i = 1; i < 8; ++i) {
    Illumination light = one_lamp(i, 2);
    light.lights[0].direction = {std::sin(0.02f * static_cast<float>(i)), 0, std::cos(0.02f * static_cast<float>(i))};
    EXPECT_TRUE(due(schedule, field, light)) << i;
    solve(schedule, field, light, albedo_of(0.5f, 0.1f));
  }
  Illumination flickers = one_lamp(9, 2.3f);
  flickers.lights[0].direction = {std::sin(0.14f), 0, std::cos(0.14f)};
  EXPECT_FALSE(due(schedule, field, flickers)) << "mains flicker";
}

}  // namespace
}  // namespace lumigraft::reconstruct
