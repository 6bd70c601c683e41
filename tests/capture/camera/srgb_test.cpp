#include "capture/camera/srgb.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace lumigraft::capture {
namespace {

TEST(Srgb, IsTheStandardCurve) {
  EXPECT_EQ(srgb_to_linear(0.0f), 0.0f);
  EXPECT_EQ(srgb_to_linear(1.0f), 1.0f);
  EXPECT_NEAR(srgb_to_linear(0.5f), 0.21404114f, 1e-6);
  EXPECT_NEAR(srgb_to_linear(0.04045f), 0.0031308f, 1e-7);
  EXPECT_EQ(linear_to_srgb(-1.0f), 0.0f);
  EXPECT_EQ(linear_to_srgb(2.0f), 1.0f);
  EXPECT_EQ(linear_to_srgb(std::nanf("")), 0.0f);
  for (int i = 0; i <= 1000; ++i) {
    EXPECT_NEAR(linear_to_srgb(srgb_to_linear(i / 1000.0f)), i / 1000.0f, 1e-6);
  }
}

long rounded(float linear) { return std::lround(255 * linear_to_srgb(linear)); }

TEST(SrgbTable, RoundsAsTheCurve) {
  const SrgbTable& table = srgb_table();
  std::mt19937 random(1);
  std::uniform_real_distribution<float> even(-0.1f, 1.1f), power(-8, 0);
  for (int i = 0; i < 300000; ++i) {
    const float linear = i % 2 ? even(random) : std::pow(10.0f, power(random));
    ASSERT_EQ(table.code(linear), rounded(linear)) << linear;
  }
  EXPECT_EQ(table.code(0), 0);
  EXPECT_EQ(table.code(std::nextafter(1.0f, 0.0f)), 255);
  EXPECT_EQ(table.code(INFINITY), 255);
  EXPECT_EQ(table.code(NAN), 0);
}

TEST(SrgbTable, RoundsAsTheCurveNextToEveryBound) {
  for (int code = 1; code < 256; ++code) {
    float linear = srgb_to_linear((static_cast<float>(code) - 0.5f) / 255);
    for (int i = 0; i < 50; ++i) linear = std::nextafter(linear, 0.0f);
    for (int i = 0; i < 100; ++i, linear = std::nextafter(linear, 1.0f)) {
      ASSERT_EQ(srgb_table().code(linear), rounded(linear)) << linear;
    }
  }
}

TEST(SrgbTable, AndBack) {
  for (int code = 0; code < 256; ++code) {
    const float linear = srgb_table().linear[static_cast<std::size_t>(code)];
    EXPECT_EQ(linear, srgb_to_linear(static_cast<float>(code) / 255.0f));
    EXPECT_EQ(srgb_table().code(linear), code);
  }
}

}  // namespace
}  // namespace lumigraft::capture
