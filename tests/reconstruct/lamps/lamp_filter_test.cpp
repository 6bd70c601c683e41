// Fusion of successive estimates of lamps.
#include "reconstruct/lamps/lamp_filter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

PointLight panel(int id) {
  PointLight light;
  light.id = id;
  light.direction = Vector3f(0.3f, 0.2f, 0.9f).normalized();
  light.irradiance = Vector3f(1, 2, 3);
  light.clipped = true;
  return light;
}

LampEstimate estimate(double log_distance, double log_gain) {
  LampEstimate result;
  result.distance_m = static_cast<float>(std::exp(log_distance));
  result.flat = true;
  result.normal = -Vector3f(0.1f, 0.2f, 0.9f).normalized();
  result.gain = Vector3f::Constant(static_cast<float>(std::exp(log_gain)));
  return result;
}

/// Correlated errors of log distance and log gain: σ `along` (1, 1), `across` (1, -1).
Eigen::MatrixXd covariance(double along, double across, int lamps = 1) {
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(kUnknownsPerLamp * lamps, kUnknownsPerLamp * lamps);
  for (int k = 0; k < lamps; ++k) {
    Eigen::MatrixXd one = 1e-4 * Eigen::MatrixXd::Identity(kUnknownsPerLamp, kUnknownsPerLamp);
    Eigen::VectorXd ridge = Eigen::VectorXd::Zero(kUnknownsPerLamp), over = ridge;
    ridge << 1, 0, 0, 1, 1, 1;
    over << 1, 0, 0, -1, -1, -1;
    one += along * along * ridge * ridge.transpose() + across * across * over * over.transpose();
    all.block(kUnknownsPerLamp * k, kUnknownsPerLamp * k, kUnknownsPerLamp, kUnknownsPerLamp) = one;
  }
  return all;
}

TEST(LampFilter, FirstSolutionIsUnchanged) {
  LampFilter filter;
  const LampEstimate first = estimate(0.4, 1);
  const auto combined = filter.combine({panel(7)}, {{first}, covariance(0.05, 0.02)});
  ASSERT_EQ(combined.size(), 1u);
  EXPECT_NEAR(combined[0].distance_m, first.distance_m, 1e-4f);
  EXPECT_LT((combined[0].normal - first.normal).norm(), 1e-4f);
  EXPECT_LT((combined[0].gain - first.gain).norm(), 1e-3f);
  EXPECT_NEAR(combined[0].log_sigma, std::sqrt(1e-4 + 0.05 * 0.05 + 0.02 * 0.02), 1e-4);
}

TEST(LampFilter, SolutionsAreWeightedByInformation) {
  LampFilter filter;
  filter.combine({panel(7)}, {{estimate(0.4, 1)}, covariance(0.3, 0.01)});
  // The second is accurate where the first is not, and wrong where the first is accurate.
  const auto combined = filter.combine({panel(7)}, {{estimate(0.2, 0.6)}, covariance(0.01, 0.3)});
  // The first determines log distance - log gain = -0.6, the second log distance + log gain = 0.8.
  EXPECT_NEAR(std::log(combined[0].distance_m), 0.1, 0.01);
  EXPECT_NEAR(std::log(combined[0].gain.x()), 0.7, 0.01);
}

TEST(LampFilter, NoiseIsAveragedAndSigmaIsThatOfOneSolution) {
  LampFilter filter;
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 0.05);
  double raw = 0, filtered = 0;
  std::vector<LampEstimate> combined;
  for (int i = 0; i < 200; ++i) {
    const double off = noise(random);
    combined = filter.combine({panel(7)}, {{estimate(0.4 + off, 1 + off)}, covariance(0.05, 0.001)});
    if (i < 20) continue;
    raw += off * off;
    filtered += std::pow(std::log(combined[0].distance_m) - 0.4, 2);
  }
  EXPECT_LT(filtered, 0.35 * raw);
  EXPECT_NEAR(combined[0].log_sigma, 0.05, 0.01);
}

TEST(LampFilter, OneOutlierChangesNothingTwoThatAgreeDo) {
  LampFilter filter;
  const Eigen::MatrixXd sure = covariance(0.02, 0.02);
  for (int i = 0; i < 5; ++i) filter.combine({panel(7)}, {{estimate(0.4, 1)}, sure});
  EXPECT_NEAR(std::log(filter.combine({panel(7)}, {{estimate(0.9, 1)}, sure})[0].distance_m), 0.4, 1e-3);
  EXPECT_NEAR(std::log(filter.combine({panel(7)}, {{estimate(0.4, 1)}, sure})[0].distance_m), 0.4, 1e-3);
  EXPECT_NEAR(std::log(filter.combine({panel(7)}, {{estimate(0.9, 1)}, sure})[0].distance_m), 0.4, 1e-3);
  EXPECT_NEAR(std::log(filter.combine({panel(7)}, {{estimate(0.91, 1)}, sure})[0].distance_m), 0.91, 1e-3);
}

TEST(LampFilter, LampIsDistantAfterTwoSolutions) {
  LampFilter filter;
  filter.combine({panel(7)}, {{estimate(0.4, 1)}, covariance(0.05, 0.02)});
  LampEstimate far = estimate(0.4, 1);
  far.far = true;
  EXPECT_FALSE(filter.combine({panel(7)}, {{far}, covariance(0.05, 0.02)})[0].far);
  EXPECT_TRUE(filter.combine({panel(7)}, {{far}, covariance(0.05, 0.02)})[0].far);
}

TEST(LampFilter, LampThatMovesRestartsOthersContinue) {
  LampFilter filter;
  const Eigen::MatrixXd sure = covariance(0.05, 0.05, 2);
  PointLight moving = panel(3);
  for (int i = 0; i < 5; ++i) filter.combine({panel(7), moving}, {{estimate(0.4, 1), estimate(0.4, 1)}, sure});
  moving.direction = Vector3f(0.33f, 0.2f, 0.9f).normalized();
  const auto combined = filter.combine({moving, panel(7)}, {{estimate(0.45, 1), estimate(0.45, 1)}, sure});
  EXPECT_NEAR(std::log(combined[0].distance_m), 0.45, 1e-3);
  EXPECT_LT(std::log(combined[1].distance_m), 0.42);
  EXPECT_GT(std::log(combined[1].distance_m), 0.4);
  // A lamp that disappears does not change the other.
  EXPECT_NEAR(std::log(filter.combine({panel(7)}, {{estimate(0.4, 1)}, covariance(0.05, 0.05)})[0].distance_m), 0.41,
              0.01);
}

}  // namespace
}  // namespace lumigraft::reconstruct
