// Distances from the outline of a mask, against OpenCV's exact transform of the whole image.
#include "relight/compose/outline_distance.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <random>

namespace lumigraft::test {
namespace {

/// Discs and single pixels, some of them at the border.
cv::Mat1b blots(const cv::Size& size) {
  cv::Mat1b mask(size, std::uint8_t{0});
  std::mt19937 random(7);
  const auto within = [&](int count) { return static_cast<int>(random() % static_cast<unsigned>(count)); };
  for (int k = 0; k < 6; ++k) {
    cv::circle(mask, {within(size.width), within(size.height)}, 3 + within(20), cv::Scalar(k % 2 == 0 ? 255 : 0), -1);
  }
  for (int k = 0; k < 5; ++k) mask(within(size.height), within(size.width)) ^= 255;
  return mask;
}

TEST(OutlineDistance, IsExactWithinItsReach) {
  constexpr int kReach_px = 9;
  // Widths that are and are not whole words; images smaller than the reach.
  for (const cv::Size size : {cv::Size(131, 77), cv::Size(128, 64), cv::Size(7, 5)}) {
    const cv::Mat1b mask = blots(size);
    cv::Mat1f inside, outside;
    cv::distanceTransform(mask, inside, cv::DIST_L2, cv::DIST_MASK_PRECISE);
    cv::distanceTransform(mask == 0, outside, cv::DIST_L2, cv::DIST_MASK_PRECISE);
    const relight::OutlineDistance away(mask, kReach_px);
    int near = 0;
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        const float exact = mask(y, x) ? 0.5f - inside(y, x) : outside(y, x) - 0.5f, found = away.at(x, y);
        EXPECT_EQ(found < 0, exact < 0) << x << ", " << y;
        if (std::abs(exact) <= kReach_px) {
          EXPECT_NEAR(found, exact, 1e-4f) << x << ", " << y;
          ++near;
        } else {
          EXPECT_GT(std::abs(found), kReach_px) << x << ", " << y;
        }
      }
    }
    int visited = 0;
    for (int y = 0; y < size.height; ++y) {
      away.for_each_near(y, [&](int x, float px) {
        EXPECT_EQ(px, away.at(x, y));
        ++visited;
      });
    }
    EXPECT_EQ(visited, near);
  }
}

TEST(OutlineDistance, WithoutAnOutlineNothingIsNear) {
  for (const int value : {0, 255}) {
    const relight::OutlineDistance away(cv::Mat1b(40, 50, static_cast<std::uint8_t>(value)), 6);
    EXPECT_GT(std::abs(away.at(20, 20)), 6);
    for (int y = 0; y < away.size().height; ++y) away.for_each_near(y, [](int, float) { ADD_FAILURE(); });
  }
}

}  // namespace
}  // namespace lumigraft::test
