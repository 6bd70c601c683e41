#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "reconstruct/albedo_schedule.h"

namespace lumigraft::reconstruct {
namespace {

// 99 of 100 bricks stay; noise of 2 % in one of them is nothing, a fifth less light is.
TEST(SceneChange, WhatMovedIsNotWhatNoiseMakesDrift) {
  const auto grey = [](float radiance) {
    auto brick = std::make_shared<FieldBrick>();
    BrickColor& color = brick->own_color();
    color.radiance.fill(Eigen::Vector3f::Constant(radiance));
    color.weight.fill(1);
    return brick;
  };
  DistanceField before, now;
  for (int i = 0; i < 100; ++i) before.bricks[{i, 0, 0}] = grey(0.5f);
  now = before;
  EXPECT_EQ(moved_fraction(now, before), 0);
  now.bricks[{0, 0, 0}] = grey(0.51f);
  EXPECT_EQ(moved_fraction(now, before), 0);
  now.bricks[{0, 0, 0}] = grey(0.4f);
  EXPECT_NEAR(moved_fraction(now, before), 0.01, 1e-6);
  now.bricks[{0, 1, 0}] = grey(0.5f);
  EXPECT_NEAR(moved_fraction(now, before), 2.0 / 101, 1e-6);
}

TEST(SceneChange, DifferenceOfTwoSolutions) {
  const auto albedo = [](float value, float sigma, std::size_t known) {
    auto brick = std::make_shared<AlbedoBrick>();
    brick->albedo.fill(Eigen::Vector3f::Constant(value));
    brick->sigma.fill(-1);
    std::fill_n(brick->sigma.begin(), known, sigma);
    AlbedoField field;
    field.bricks[{0, 0, 0}] = brick;
    return field;
  };
  const AlbedoDelta news = compare_albedo(albedo(0.51f, 0.08f, 400), albedo(0.5f, 0.1f, 300));
  EXPECT_NEAR(news.change, 0.02, 1e-4);
  EXPECT_NEAR(news.newly_known, 0.25, 1e-6);
  EXPECT_NEAR(news.surer, 0.2, 1e-4);
}

}  // namespace
}  // namespace lumigraft::reconstruct
