#include "relight/animation/animated_value.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/relight/animation/animated_models.h"

namespace lumigraft::test {
namespace {

using relight::AnimatedValue;
using relight::Interpolation;

float angle_about_z(const Eigen::Quaternionf& q) {
  const Eigen::Vector3f x = q * Eigen::Vector3f::UnitX();
  return std::atan2(x.y(), x.x());
}

constexpr float kQuarter = std::numbers::pi_v<float> / 2;

TEST(AnimatedValue, StepAndLinearHoldTheEnds) {
  AnimatedValue value = value_of(2, {1, 2, 4}, {10, 0, 20, 4, 0, 8});
  EXPECT_EQ(value.at(0), (std::vector<float>{10, 0}));
  EXPECT_EQ(value.at(1.5), (std::vector<float>{15, 2}));
  EXPECT_EQ(value.at(2), (std::vector<float>{20, 4}));
  EXPECT_EQ(value.at(3.5), (std::vector<float>{5, 7}));
  EXPECT_EQ(value.at(9), (std::vector<float>{0, 8}));
  value.interpolation = Interpolation::step;
  EXPECT_EQ(value.at(1.999), (std::vector<float>{10, 0}));
  EXPECT_EQ(value.at(2), (std::vector<float>{20, 4}));
}

TEST(AnimatedValue, TheLaterOfTwoKeysAtOneTimeCounts) {
  const AnimatedValue value = value_of(1, {0, 1, 1, 2}, {0, 1, 5, 6});
  EXPECT_FLOAT_EQ(value.at(0.5)[0], 0.5f);
  EXPECT_FLOAT_EQ(value.at(1)[0], 5);
  EXPECT_FLOAT_EQ(value.at(1.5)[0], 5.5f);
}

// A cubic polynomial is its own spline.
TEST(AnimatedValue, CubicSplinesAreTheirPolynomial) {
  const auto p = [](float t) { return 2 * t * t * t - 3 * t * t + t + 1; };
  const auto slope = [](float t) { return 6 * t * t - 6 * t + 1; };
  const AnimatedValue value =
      value_of(1, {1, 3}, {99, p(1), slope(1), slope(3), p(3), 99}, Interpolation::cubic_spline);
  for (const float t : {1.0f, 1.5f, 2.2f, 2.9f, 3.0f}) EXPECT_NEAR(value.at(t)[0], p(t), 1e-4f) << t;
  EXPECT_FLOAT_EQ(value.at(0)[0], p(1));
  EXPECT_FLOAT_EQ(value.at(7)[0], p(3));
}

TEST(AnimatedValue, RotationsTakeTheShorterArcAtEvenSpeed) {
  EXPECT_NEAR(angle_about_z(quarter_turn().rotation_at(0.5)), kQuarter / 2, 1e-6f);
  EXPECT_NEAR(angle_about_z(quarter_turn().rotation_at(0.25)), kQuarter / 4, 1e-6f);
  AnimatedValue other = quarter_turn();
  for (std::size_t i = 4; i < 8; ++i) other.values[i] *= -3;  // the same rotation, not of length 1
  EXPECT_NEAR(angle_about_z(other.rotation_at(0.25)), kQuarter / 4, 1e-6f);
  EXPECT_NEAR(other.rotation_at(0.9).norm(), 1, 1e-6f);
  other.interpolation = Interpolation::step;
  EXPECT_NEAR(angle_about_z(other.rotation_at(0.9)), 0, 1e-6f);
  EXPECT_NEAR(angle_about_z(other.rotation_at(1)), kQuarter, 1e-6f);
}

TEST(AnimatedValue, CubicRotationsAreMadeUnit) {
  const float half = std::sqrt(0.5f);
  const AnimatedValue value =
      value_of(4, {0, 1}, {0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, half, half, 0, 0, 0, 0},
               Interpolation::cubic_spline);
  const Eigen::Quaternionf middle = value.rotation_at(0.5);
  EXPECT_NEAR(middle.norm(), 1, 1e-6f);
  EXPECT_NEAR(angle_about_z(middle), kQuarter / 2, 1e-6f) << "by symmetry";
}

}  // namespace
}  // namespace lumigraft::test
