#include "tests/bench/comparators/imperfect_shadow_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/relight/reference/reference_rooms.h"

namespace lumigraft::comparators {
namespace {

using namespace lumigraft::test;

TEST(ScatterPoints, AreEvenByArea) {
  // The pairs of faces of a 1 × 2 × 4 box have 4, 8 and 16 of 28 parts of its area.
  const ScenePoints scattered = scatter_points({mesh_of(box({0, 0, 0}, {1, 2, 4}), lambert(0.5f))}, 7000, 0);
  EXPECT_NEAR(scattered.area_m2, 28, 1e-4);
  const auto facing = [&](int axis) {
    return std::count_if(scattered.points.begin(), scattered.points.end(),
                         [&](const ScenePoint& p) { return std::abs(p.normal[axis]) > 0.9f; });
  };
  EXPECT_NEAR(static_cast<double>(facing(0)), 4000, 70);
  EXPECT_NEAR(static_cast<double>(facing(1)), 2000, 70);
  EXPECT_NEAR(static_cast<double>(facing(2)), 1000, 70);
}

// A light on the floor under a horizontal disc whose radius is half of its height: on a ceiling twice as high, the
// shadow is a disc with the radius of the disc's height.
TEST(ImperfectShadowMap, ShadowOfADiscHasItsArea) {
  constexpr float kHeight = 0.5f;
  VirtualLight light;
  ImperfectShadowMap map(64);
  map.clear(light);
  map.draw(scatter_points({square(3, 2 * kHeight, lambert(0.5f))}, 4000, 0), 0, 4000);
  map.draw(scatter_points({disc(0.5f * kHeight, kHeight, lambert(0.5f))}, 1000, 1), 0, 1000);
  map.fill_holes();
  constexpr int kAcross = 200;
  constexpr float kReach = 1.5f;
  int hidden = 0, wrong = 0;
  for (int i = 0; i < kAcross * kAcross; ++i) {
    const float x = kReach * (2 * (static_cast<float>(i % kAcross) + 0.5f) / kAcross - 1);
    const float y = kReach * (2 * (static_cast<float>(i / kAcross) + 0.5f) / kAcross - 1);
    const bool open = map.open({x, y, 2 * kHeight}), truth = x * x + y * y > kHeight * kHeight;
    hidden += open ? 0 : 1;
    wrong += open == truth ? 0 : 1;
  }
  const double area = 4 * kReach * kReach / (kAcross * kAcross), exact = relight::kPi * kHeight * kHeight;
  EXPECT_NEAR(hidden * area, exact, 0.25 * exact);
  EXPECT_LT(wrong * area, 0.25 * exact);
}

TEST(ImperfectShadowMap, HolesBetweenPointsAreFilledAndTheSkyIsNot) {
  VirtualLight light;
  ImperfectShadowMap map(64);
  map.clear(light);
  map.draw(scatter_points({square(0.3f, 1, lambert(0.5f))}, 4000, 0), 0, 60);
  map.fill_holes();
  int open = 0;
  for (int i = 0; i < 400; ++i) {
    const float x = 0.8f * (static_cast<float>(i % 20) / 19 - 0.5f),
                y = 0.8f * (static_cast<float>(i / 20) / 19 - 0.5f);
    open += map.open({x * 0.6f, y * 0.6f, 2}) ? 1 : 0;
  }
  EXPECT_LT(open, 40) << "of 400 points behind the square";
  EXPECT_TRUE(map.open({4, 0, 2})) << "next to the square";
  EXPECT_FALSE(map.open({0, 0, -1})) << "under the light's own surface";
}

}  // namespace
}  // namespace lumigraft::comparators
