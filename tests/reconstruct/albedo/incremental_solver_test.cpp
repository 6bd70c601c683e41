// Incremental solutions: as accurate as complete ones, at lower cost.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <vector>

#include "reconstruct/albedo/albedo.h"
#include "tests/reconstruct/albedo/albedo_agreement.h"
#include "tests/reconstruct/albedo/albedo_room.h"

namespace lumigraft::reconstruct {
namespace {

/// A tiled floor with two boxes in the light of two lamps.
TestRoom large_room() {
  TestRoom room;
  room.half_m = 1.1f;
  room.lamps = {{{0.4f, -0.5f, 0.9f}, {1.2f, 1.0f, 0.8f}, 0.04f}, {{-0.8f, 0.7f, 1.4f}, {0.8f, 1.2f, 1.8f}, 0.05f}};
  room.ambient = Eigen::Vector3f::Constant(0.03f);
  room.boxes = {{{0.05f, -0.1f, 0.0f}, {0.15f, 0.05f, 0.15f}}, {{-0.6f, -0.5f, 0.0f}, {-0.45f, -0.4f, 0.12f}}};
  room.albedo = [](const Eigen::Vector3f& p) {
    const bool dark = static_cast<int>(std::floor(p.x() / 0.3f) + std::floor(p.y() / 0.3f)) % 2;
    return Eigen::Vector3f((dark ? 0.3f : 0.6f) * Eigen::Vector3f(1, 0.8f, 0.6f));
  };
  return room;
}

/// The first `bricks` bricks of `all_field`, column by column, as a camera that sweeps the room adds them; the pointers
/// are the same.
DistanceField seen_part(const DistanceField& all_field, std::size_t bricks, std::uint64_t version) {
  std::vector<BrickKey> keys;
  for (const auto& [key, brick] : all_field.bricks) keys.push_back(key);
  std::sort(keys.begin(), keys.end());
  DistanceField field;
  field.version = version;
  for (std::size_t i = 0; i < std::min(bricks, keys.size()); ++i) field.bricks[keys[i]] = all_field.bricks.at(keys[i]);
  return field;
}

double cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

TEST(IncrementalSolver, SweepEndsAtTheCompleteSolution) {
  const TestRoom room = large_room();
  const DistanceField all_field = room.field();
  const Illumination seen = room.illumination();
  AlbedoStage sweeping{capture::Session()};
  constexpr int kSteps = 40;
  int alone = 0;
  AlbedoStage::Result last;
  DistanceField field;
  for (int step = 0; step <= kSteps; ++step) {
    const double fraction = 0.5 + 0.5 * step / kSteps;
    field = seen_part(all_field, static_cast<std::size_t>(fraction * static_cast<double>(all_field.bricks.size())),
                      static_cast<std::uint64_t>(step + 1));
    last = sweeping.solve(field, seen);
    alone += !last.complete;
  }
  EXPECT_GT(alone, 25);
  AlbedoStage at_once{capture::Session()};
  const auto all = at_once.solve(field, seen);
  ASSERT_TRUE(all.complete);
  const Agreement agree = agreement(*last.albedo, *all.albedo);
  std::printf("sweep: %d of %d alone, within sigma %.4f, mean %.4f, known %.4f\n", alone, kSteps, agree.within_sigma,
              agree.mean, agree.known);
  EXPECT_GT(agree.within_sigma, 0.98);
  EXPECT_NEAR(agree.mean, 1, 0.01);
  EXPECT_GT(agree.known, 0.99);
}

// Samples that are held while others are solved do not accumulate errors.
TEST(IncrementalSolver, NoDriftOverManySolutions) {
  TestRoom room = large_room();
  room.half_m = 0.7f;
  const DistanceField all_field = room.field();
  const Illumination seen = room.illumination();
  AlbedoStage stage{capture::Session()};
  const auto first = stage.solve(all_field, seen);
  // A shadow sweeps over the floor and disappears, several times.
  constexpr int kOnce = 36, kTimes = 5;
  std::vector<Agreement> agree;
  for (int i = 0; i < kOnce * kTimes; ++i) {
    DistanceField field = all_field;
    field.version = static_cast<std::uint64_t>(i + 2);
    const bool gone = i % kOnce == kOnce - 1;
    for (const auto& [key, brick] : all_field.bricks) {
      if (gone || (key[0] != i % 18 - 9 && key[0] != i % 18 - 8)) continue;
      auto darker = std::make_shared<FieldBrick>(*brick);
      for (Eigen::Vector3f& radiance : darker->own_color().radiance) radiance *= 0.5f;
      field.bricks[key] = darker;
    }
    const auto found = stage.solve_incremental(field, seen);
    ASSERT_TRUE(found);
    ASSERT_FALSE(found->complete);
    if (gone) agree.push_back(agreement(*found->albedo, *first.albedo));
  }
  for (const Agreement& a : agree) {
    std::printf("drift: within sigma %.4f, mean %.4f\n", a.within_sigma, a.mean);
    EXPECT_GT(a.within_sigma, 0.95);
    EXPECT_NEAR(a.mean, 1, 0.003);
    EXPECT_EQ(a.known, 1);
  }
  EXPECT_NEAR(agree.back().within_sigma, agree.front().within_sigma, 2e-4);
  EXPECT_NEAR(agree.back().mean, agree.front().mean, 2e-4);
}

TEST(IncrementalSolver, CostDependsOnTheChangeNotTheRoom) {
  struct Cost {
    double all_ms = 0, new_ms = 1e9;
    std::size_t samples = 0;
  };
  const auto cost = [](float half_m) {
    TestRoom room = large_room();
    room.half_m = half_m;
    DistanceField all_field = room.field(), without = all_field;
    // A patch of 3 by 3 bricks next to the tag.
    for (const auto& [key, brick] : all_field.bricks)
      if (key[0] >= 2 && key[0] <= 4 && key[1] >= 2 && key[1] <= 4) without.bricks.erase(key);
    AlbedoStage stage{capture::Session()};
    Cost result;
    const double start_ms = cpu_ms();
    stage.solve(without, room.illumination());
    result.all_ms = cpu_ms() - start_ms;
    for (int i = 0; i < 3; ++i) {
      all_field.version += 2;
      const double begin_ms = cpu_ms();
      const auto found = stage.solve_incremental(all_field, room.illumination());
      result.new_ms = std::min(result.new_ms, cpu_ms() - begin_ms);
      result.samples = found ? found->samples : 0;
      without.version = all_field.version + 1;
      stage.solve_incremental(without, room.illumination());
    }
    return result;
  };
  const Cost small = cost(0.5f), large = cost(1.2f);
  for (const Cost& c : {small, large})
    std::printf("cost: all %.0f ms, %zu samples alone %.1f ms\n", c.all_ms, c.samples, c.new_ms);
  EXPECT_GT(small.samples, 0u);
  EXPECT_LE(large.samples, small.samples);
  EXPECT_LT(large.new_ms, 2 * small.new_ms);
  EXPECT_LT(large.new_ms, 0.1 * large.all_ms);
}

}  // namespace
}  // namespace lumigraft::reconstruct
