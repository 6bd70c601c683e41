#include "reconstruct/exposure/new_surface.h"

#include <gtest/gtest.h>

namespace lumigraft::reconstruct {
namespace {

constexpr std::int64_t kFrame_ns = 100'000'000;

/// A wall of 1 m at this depth.
std::vector<Eigen::Vector3f> wall(float y_m) {
  std::vector<Eigen::Vector3f> points_m;
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 20; ++j)
      points_m.emplace_back(0.05f * static_cast<float>(i) + 0.01f, y_m, 0.05f * static_cast<float>(j) + 0.01f);
  return points_m;
}

std::vector<Eigen::Vector3f> with_visitor() {
  std::vector<Eigen::Vector3f> points_m = wall(0.05f);
  points_m.emplace_back(0.5f, -1, 0.5f);
  return points_m;
}

TEST(NewSurface, WhoComesIsNewForSomeSeconds) {
  NewSurface surface;
  std::int64_t now_ns = 0;
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(surface.find(wall(0.05f), now_ns += kFrame_ns).empty());
  for (int i = 0; i < 25; ++i) {
    const auto found_m = surface.find(with_visitor(), now_ns += kFrame_ns);
    ASSERT_EQ(found_m.size(), 1u) << i;
    EXPECT_EQ(found_m[0].y(), -1);
  }
  for (int i = 0; i < 10; ++i) surface.find(with_visitor(), now_ns += kFrame_ns);
  EXPECT_TRUE(surface.find(with_visitor(), now_ns += kFrame_ns).empty()) << "part of the room";
  now_ns += 10 * 1'000'000'000LL;
  EXPECT_TRUE(surface.find(with_visitor(), now_ns).empty()) << "nobody looked";
  for (int i = 0; i < 35; ++i) EXPECT_TRUE(surface.find(wall(0.05f), now_ns += kFrame_ns).empty());
  EXPECT_EQ(surface.find(with_visitor(), now_ns += kFrame_ns).size(), 1u) << "another one";
}

TEST(NewSurface, NoiseOfDepthIsNotNew) {
  NewSurface surface;
  surface.find(wall(0.05f), 0);
  EXPECT_TRUE(surface.find(wall(0.11f), kFrame_ns).empty());
}

TEST(NewSurface, PointsAreBounded) {
  NewSurface surface;
  surface.find(wall(3), 0);
  std::vector<Eigen::Vector3f> crowd_m;
  for (int k = 0; k < 10; ++k) {
    for (const Eigen::Vector3f& p_m : wall(0.05f - 0.5f * static_cast<float>(k))) crowd_m.push_back(p_m);
  }
  const auto found_m = surface.find(crowd_m, kFrame_ns);
  EXPECT_GT(found_m.size(), 250u);
  EXPECT_LE(found_m.size(), 500u);
}

}  // namespace
}  // namespace lumigraft::reconstruct
