#include "relight/tracing/sampler.h"

#include <gtest/gtest.h>

#include <set>
#include <utility>

namespace lumigraft::relight {
namespace {

/// The definition of a (0, m, 2)-net (Sobol' 1967), which scrambling and shuffling of whole blocks keep.
TEST(Sampler, EveryElementaryIntervalHasOneSampleOfABlock) {
  constexpr int kLog = 6;
  for (std::uint32_t pixel = 0; pixel < 20; ++pixel) {
    for (std::uint32_t block = 0; block < 3; ++block) {
      for (int across = 0; across <= kLog; ++across) {
        std::set<std::pair<int, int>> filled;
        for (std::uint32_t i = 0; i < 1 << kLog; ++i) {
          Sampler sampler(7, pixel, (block << kLog) + i);
          sampler.two();
          const Eigen::Vector2f second = sampler.two();
          filled.emplace(static_cast<int>(second.x() * (1 << across)),
                         static_cast<int>(second.y() * (1 << (kLog - across))));
        }
        EXPECT_EQ(filled.size(), 1u << kLog) << "2^" << across << " columns, pixel " << pixel;
      }
    }
  }
}

TEST(Sampler, PairsAndPixelsAreIndependent) {
  double between_pairs = 0, between_pixels = 0;
  constexpr std::uint32_t kSamples = 4096;
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    Sampler one(1, 5, i), other(1, 6, i);
    const Eigen::Vector2f a = one.two(), b = one.two(), c = other.two();
    between_pairs += (a.x() - 0.5) * (b.x() - 0.5);
    between_pixels += (a.x() - 0.5) * (c.x() - 0.5);
  }
  // Independent: 1/12 is the variance of one value, and the mean of the products deviates by 1/12/√n (1σ).
  EXPECT_NEAR(between_pairs / kSamples, 0, 4.0 / 12 / 64);
  EXPECT_NEAR(between_pixels / kSamples, 0, 4.0 / 12 / 64);
}

}  // namespace
}  // namespace lumigraft::relight
