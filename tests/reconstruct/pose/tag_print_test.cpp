// Means of a print over boxes.
#include "reconstruct/pose/tag_print.h"

#include <gtest/gtest.h>

#include <random>

namespace lumigraft::reconstruct {
namespace {

TagPattern chequers() {
  TagPattern pattern;
  pattern.cells = 10;
  pattern.square_cells = 8;
  for (int i = 0; i < 100; ++i) pattern.white.push_back((i * 7 / 3 + i / 10) % 3 == 0);
  return pattern;
}

TEST(PrintIntegral, MeansOfPartsAddUp) {
  const TagPattern pattern = chequers();
  const PrintIntegral print(pattern);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(2, 8), size(0.05, 0.95);
  for (int i = 0; i < 1000; ++i) {
    const double x = place(random), y = place(random), width = size(random), height = size(random);
    double sum = 0;
    for (int k = -1; k <= 1; ++k)
      for (int l = -1; l <= 1; ++l) sum += print.mean(x + k * width, y + l * height, width, height).white;
    EXPECT_NEAR(print.mean(x, y, 3 * width, 3 * height).white, sum / 9, 1e-12);
  }
}

TEST(PrintIntegral, DerivativesMatchDifferences) {
  const TagPattern pattern = chequers();
  const PrintIntegral print(pattern);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> place(2, 8), size(0.05, 2.5);
  constexpr double kStep = 1e-6, kKink = 1e-5;
  const auto far_from_edges = [&](double at) { return std::abs(at - std::round(at)) > kKink; };
  for (int i = 0; i < 1000; ++i) {
    const double x = place(random), y = place(random), width = size(random), height = size(random);
    if (!far_from_edges(x - width / 2) || !far_from_edges(x + width / 2) || !far_from_edges(y - height / 2) ||
        !far_from_edges(y + height / 2))
      continue;
    const auto mean = print.mean(x, y, width, height);
    const auto white = [&](double dx, double dy, double scale) {
      return print.mean(x + dx, y + dy, scale * width, scale * height).white;
    };
    EXPECT_NEAR(mean.by_centre.x(), (white(kStep, 0, 1) - white(-kStep, 0, 1)) / (2 * kStep), 1e-5);
    EXPECT_NEAR(mean.by_centre.y(), (white(0, kStep, 1) - white(0, -kStep, 1)) / (2 * kStep), 1e-5);
    EXPECT_NEAR(mean.by_scale, (white(0, 0, 1 + kStep) - white(0, 0, 1 - kStep)) / (2 * kStep), 1e-5);
  }
}

}  // namespace
}  // namespace lumigraft::reconstruct
