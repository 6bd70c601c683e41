#include "reconstruct/albedo/kept_albedo.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

std::shared_ptr<AlbedoBrick> brick_of_albedo(float albedo, float sigma) {
  auto brick = std::make_shared<AlbedoBrick>();
  brick->albedo.fill(Vector3f::Constant(albedo));
  brick->sigma.fill(sigma);
  return brick;
}

TEST(KeptAlbedoTest, CompletesWhatASolutionDoesNotKnow) {
  auto kept = std::make_shared<AlbedoField>();
  for (const int x : {0, 1, 2}) kept->bricks[{x, 0, 0}] = brick_of_albedo(0.3f, 0.1f);
  KeptAlbedo completing(kept);
  EXPECT_EQ(completing.complete(nullptr), kept) << "nothing is solved yet";
  auto solved = std::make_shared<AlbedoField>();
  solved->version = 7;
  solved->bricks[{0, 0, 0}] = brick_of_albedo(0.6f, 0.05f);
  auto half = brick_of_albedo(0.6f, 0.05f);
  for (std::size_t i = 0; i < kBrickVoxels / 2; ++i) half->sigma[i] = -1;
  solved->bricks[{1, 0, 0}] = half;
  solved->bricks[{5, 0, 0}] = brick_of_albedo(0.7f, 0.05f);
  const auto all = completing.complete(solved);
  EXPECT_EQ(all->version, 7u);
  ASSERT_EQ(all->bricks.size(), 4u);
  EXPECT_EQ(all->bricks.at({0, 0, 0}), solved->bricks.at({0, 0, 0})) << "all of it is known";
  EXPECT_EQ(all->bricks.at({2, 0, 0}), kept->bricks.at({2, 0, 0}));
  EXPECT_EQ(all->bricks.at({5, 0, 0}), solved->bricks.at({5, 0, 0}));
  const AlbedoBrick& both = *all->bricks.at({1, 0, 0});
  EXPECT_FLOAT_EQ(both.albedo[0].x(), 0.3f);
  EXPECT_FLOAT_EQ(both.sigma[0], 0.1f);
  EXPECT_FLOAT_EQ(both.albedo[kBrickVoxels - 1].x(), 0.6f);
  // Later stages recognize by the pointer what did not change.
  EXPECT_EQ(completing.complete(solved)->bricks.at({1, 0, 0}), all->bricks.at({1, 0, 0}));
}

TEST(KeptAlbedoTest, LaterItIsLessCertain) {
  // Sqrt((0.03² + (0.1 · 0.4)²) / 0.75).
  EXPECT_NEAR(sigma_later({Vector3f::Constant(0.4f), 0.03f}, 0.1f), 0.05f / std::sqrt(0.75f), 1e-6f);
}

}  // namespace
}  // namespace lumigraft::reconstruct
