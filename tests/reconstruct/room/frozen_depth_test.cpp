// Depth cameras that repeat one picture.
#include "reconstruct/room/frozen_depth.h"

#include <gtest/gtest.h>

#include <random>

namespace lumigraft::reconstruct {
namespace {

constexpr int kColumns = 320, kRows = 240;

/// A picture of coarse grain, seen by a camera that has moved by so many pixels. `gain`: of the light.
std::shared_ptr<const capture::Frame> picture(int moved_px, double gain = 1) {
  auto frame = std::make_shared<capture::Frame>();
  frame->encoded = capture::Image<std::uint8_t>(kColumns, kRows, 3);
  std::mt19937 random(static_cast<unsigned>(moved_px + 5));
  std::normal_distribution<double> noise(0, 2);
  for (int v = 0; v < kRows; ++v) {
    for (int u = 0; u < kColumns; ++u) {
      const unsigned cell = static_cast<unsigned>((u + moved_px) / 6 * 7919 + v / 6 * 104729) * 2654435761u;
      const double code = gain * (80 + (cell >> 24) * 0.3) + noise(random);
      for (int c = 0; c < 3; ++c) frame->encoded.at(u, v, c) = static_cast<std::uint8_t>(code);
    }
  }
  return frame;
}

std::shared_ptr<const capture::DepthFrame> depth(std::int64_t time_ns, float depth_m) {
  auto frame = std::make_shared<capture::DepthFrame>();
  frame->stamp.time_ns = time_ns;
  frame->depth_m = capture::Image<float>(kColumns, kRows, 1, depth_m);
  return frame;
}

capture::FrameSet frame_of(std::shared_ptr<const capture::Frame> color, std::int64_t depth_ns, float depth_m) {
  capture::FrameSet frame;
  frame.color = std::move(color);
  frame.depth = depth(depth_ns, depth_m);
  return frame;
}

TEST(FrozenDepth, IsNotUsedWhileTheCameraMoves) {
  FrozenDepth check;
  EXPECT_TRUE(check.check(frame_of(picture(0), 0, 1)).depth);
  for (int i = 1; i <= 4; ++i) {
    const capture::FrameSet checked = check.check(frame_of(picture(8 * i), i, 1));
    EXPECT_FALSE(checked.depth) << i;
    EXPECT_TRUE(checked.color);
    ASSERT_EQ(check.warnings().size(), 1u);
  }
  EXPECT_TRUE(check.check(frame_of(picture(40), 5, 1.001f)).depth) << "it is back at once";
  EXPECT_TRUE(check.warnings().empty());
}

TEST(FrozenDepth, IsDepthOfNowWhileNothingMoves) {
  FrozenDepth check;
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(check.check(frame_of(picture(0, 1 - 0.2 * i), i, 1)).depth) << "light " << i;
  EXPECT_TRUE(check.warnings().empty());
}

TEST(FrozenDepth, ATagOrAHandThatMovesIsNotTheCamera) {
  FrozenDepth check;
  check.check(frame_of(picture(0), 0, 1));
  auto pushed = std::make_shared<capture::Frame>(*picture(0));
  const auto other = picture(50);
  for (int v = 60; v < 160; ++v)
    for (int u = 100; u < 220; ++u)
      for (int c = 0; c < 3; ++c) pushed->encoded.at(u, v, c) = other->encoded.at(u, v, c);
  EXPECT_TRUE(check.check(frame_of(pushed, 1, 1)).depth);
}

TEST(FrozenDepth, OneDepthPictureMayBelongToTwoOfColour) {
  FrozenDepth check;
  check.check(frame_of(picture(0), 0, 1));
  EXPECT_TRUE(check.check(frame_of(picture(8), 0, 1)).depth);
}

TEST(FrozenDepth, NothingIsSaidOfARoomWithoutTexture) {
  FrozenDepth check;
  auto even = std::make_shared<capture::Frame>();
  even->encoded = capture::Image<std::uint8_t>(kColumns, kRows, 3, 120);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(check.check(frame_of(even, i, 1)).depth);
}

}  // namespace
}  // namespace lumigraft::reconstruct
