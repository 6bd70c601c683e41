#include "reconstruct/pose/filter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kSigmaM = 0.5e-3, kSigmaRad = 0.5e-3;

struct Noise {
  std::mt19937 random{7};
  std::normal_distribution<double> gauss;
  Isometry3d operator()(const Isometry3d& pose) {
    const auto vector = [&]() -> Vector3d {
      return Vector3d(gauss(random), gauss(random), gauss(random)) / std::sqrt(3.0);
    };
    Isometry3d noisy = pose;
    noisy.translation() += kSigmaM * vector();
    const Vector3d turn = kSigmaRad * vector();
    noisy.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()) * noisy.linear();
    return noisy;
  }
};

Isometry3d start() {
  Isometry3d pose = Isometry3d::Identity();
  pose.translation() = Vector3d(0.1, 0.2, 0.9);
  pose.linear() = Eigen::AngleAxisd(2.1, Vector3d(1, 0.2, 0.1).normalized()).toRotationMatrix();
  return pose;
}

TEST(PoseFilter, AStillCameraIsAveraged) {
  PoseFilter filter;
  Noise noise;
  double sum = 0;
  for (int i = 0; i < 200; ++i) {
    const Isometry3d pose = filter.update(noise(start()), kSigmaM, kSigmaRad);
    if (i >= 50) sum += (pose.translation() - start().translation()).squaredNorm() / 150;
  }
  EXPECT_LT(std::sqrt(sum), kSigmaM / 3);
}

TEST(PoseFilter, EqualMeasurementsChangeNothing) {
  PoseFilter filter;
  const Isometry3d first = filter.update(start(), kSigmaM, kSigmaRad);
  EXPECT_LT((first.matrix() - start().matrix()).norm(), 1e-12);
  for (int i = 0; i < 100; ++i)
    EXPECT_LT((filter.update(start(), kSigmaM, kSigmaRad).matrix() - first.matrix()).norm(), 1e-12);
}

TEST(PoseFilter, AMovingCameraDoesNotLag) {
  for (const double speed_m : {5e-5, 2e-4, 1e-3, 1e-2}) {  // per frame: 1.5 mm/s to 0.3 m/s at 30 Hz
    PoseFilter filter;
    Noise noise;
    double along = 0;
    for (int i = 0; i < 200; ++i) {
      Isometry3d truth = start();
      truth.translation().x() += speed_m * i;
      const Isometry3d pose = filter.update(noise(truth), kSigmaM, kSigmaRad);
      if (i >= 50) along += (truth.translation().x() - pose.translation().x()) / 150;
    }
    EXPECT_LT(std::abs(along), 1.5 * kSigmaM) << speed_m;
    if (speed_m > 5e-3) {
      EXPECT_LT(std::abs(along), 0.2 * kSigmaM);
    }
  }
}

TEST(PoseFilter, AJumpIsFollowedAtOnce) {
  PoseFilter filter;
  for (int i = 0; i < 100; ++i) filter.update(start(), kSigmaM, kSigmaRad);
  Isometry3d moved = start();
  moved.translation().y() += 0.02;
  EXPECT_LT((filter.update(moved, kSigmaM, kSigmaRad).translation() - moved.translation()).norm(), 1e-9);
}

}  // namespace
}  // namespace lumigraft::reconstruct
