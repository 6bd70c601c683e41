#include "server/bench/flip.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace lumigraft::server {
namespace {

constexpr int kFlipWidth = 56, kFlipHeight = 40;

capture::Image<float> plain(const std::array<float, 3>& colour) {
  capture::Image<float> picture(kFlipWidth, kFlipHeight, 3);
  for (std::size_t i = 0; i < picture.data.size(); ++i) {
    picture.data[i] = colour[i % 3];
  }
  return picture;
}

/// Slanted sawtooth ramps: contain edges, points and all colours.
capture::Image<float> ramps(int down, int colour, int from) {
  capture::Image<float> picture(kFlipWidth, kFlipHeight, 3);
  for (int y = 0; y < kFlipHeight; ++y) {
    for (int x = 0; x < kFlipWidth; ++x) {
      for (int c = 0; c < 3; ++c) {
        picture.at(x, y, c) = static_cast<float>((3 * x + down * y + colour * c + from) % 256) / 255.0f;
      }
    }
  }
  return picture;
}

TEST(BenchFlip, APictureEqualsItself) { EXPECT_EQ(mean_flip(ramps(5, 50, 0), ramps(5, 50, 0)), 0.0); }

// Uniform pictures have no features, so only the colour counts. The scale ends at the distance of green and blue (sec.
// 4.1.3).
TEST(BenchFlip, GreenAgainstBlueIsTheMaximum) { EXPECT_NEAR(mean_flip(plain({0, 1, 0}), plain({0, 0, 1})), 1.0, 1e-4); }

// Black against white: 100^0.7 on the scale of eq. 9, whose end, green against blue, is 41.27 (eq. 6 and 7 by hand:
// L*a*b* (87.735, -86.182, 83.180) and (32.297, 79.187, -107.860), chroma times 0.01 L*).
TEST(BenchFlip, BlackAgainstWhiteByHand) {
  const double a = -0.87735 * 86.182 - 0.32297 * 79.187, b = 0.87735 * 83.180 + 0.32297 * 107.860;
  const double max_distance = std::pow(87.735 - 32.297 + std::hypot(a, b), 0.7);
  const double expected = 0.95 + (std::pow(100.0, 0.7) - 0.4 * max_distance) / (0.6 * max_distance) * 0.05;
  EXPECT_NEAR(mean_flip(plain({0, 0, 0}), plain({1, 1, 1})), expected, 1e-4);
}

// Results of NVIDIA's program (1.7) for the same pictures.
TEST(BenchFlip, AgreesWithTheAuthorsProgram) {
  EXPECT_NEAR(mean_flip(plain({0, 0, 0}), plain({1, 1, 1})), 0.967395, 1e-4);
  EXPECT_NEAR(mean_flip(plain({0.5f, 0.5f, 0.5f}), plain({0.6f, 0.5f, 0.4f})), 0.326071, 1e-4);
  EXPECT_NEAR(mean_flip(ramps(5, 50, 0), ramps(4, 60, 12)), 0.482314, 1e-4);
  capture::Image<float> step = plain({0.2f, 0.2f, 0.2f});
  for (int y = 0; y < kFlipHeight; ++y) {
    for (int x = kFlipWidth / 2; x < kFlipWidth; ++x) {
      for (int c = 0; c < 3; ++c) {
        step.at(x, y, c) = 0.8f;
      }
    }
  }
  EXPECT_NEAR(mean_flip(plain({0.2f, 0.2f, 0.2f}), step), 0.510796, 1e-4);
}

}  // namespace
}  // namespace lumigraft::server
