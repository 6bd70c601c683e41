// Planes at grazing angles and jumps in depth, with the noise of depth cameras.
#include "reconstruct/fusion/steep_plane.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

namespace lumigraft::reconstruct {
namespace {

constexpr int kEdge = 16, kFirst = 7;  ///< the block of 2 × 2 pixels in the middle
constexpr float kFocal = 525;
constexpr double kDepth_m = 0.8;

/// Tangent of incidence over slope of inverse depth per pixel, at kDepth_m.
constexpr double kTangentBySlope = kFocal * kDepth_m;

/// `inverse_depth`: 1/m, by pixels from the middle. `incidence_rad`: of its noise.
PreparedDepth view_of(const std::function<double(double, double)>& inverse_depth, double incidence_rad, unsigned seed) {
  PreparedDepth view;
  view.width = view.height = kEdge;
  view.noise_scale = 1;
  std::mt19937 random(seed);
  std::normal_distribution<double> noise;
  for (int v = 0; v < kEdge; ++v) {
    for (int u = 0; u < kEdge; ++u) {
      const double depth_m = 1 / inverse_depth(u - kFirst - 0.5, v - kFirst - 0.5);
      view.inverse_depth.push_back(
          static_cast<float>(1 / (depth_m + capture::DepthNoise().sigma_m(depth_m, incidence_rad) * noise(random))));
    }
  }
  return view;
}

double radians(double degrees) { return degrees * std::numbers::pi / 180; }

TEST(SteepPlane, IsFoundWithItsSlope) {
  for (const double incidence : {80.0, 82.0, 83.5}) {
    for (const double turn : {0.0, 45.0, 90.0, 200.0}) {
      const double slope = std::tan(radians(incidence)) / kTangentBySlope;
      const double by_u = slope * std::cos(radians(turn)), by_v = slope * std::sin(radians(turn));
      int found = 0;
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      constexpr int kTrials = 100;
      for (unsigned seed = 0; seed < kTrials; ++seed) {
        const PreparedDepth view =
            view_of([&](double x, double y) { return 1 / kDepth_m + by_u * x + by_v * y; }, radians(incidence), seed);
        const auto plane = steep_plane_at(view, kFirst, kFirst, kFocal, {});
        if (!plane) continue;
        ++found;
        mean += Eigen::Vector3d(plane->inverse_depth, plane->by_u, plane->by_v);
      }
      EXPECT_GE(found, 80) << incidence << " " << turn;
      mean /= found;
      EXPECT_NEAR(mean[0], 1 / kDepth_m, 0.005) << incidence << " " << turn;
      EXPECT_NEAR(mean[1], by_u, 0.05 * slope) << incidence << " " << turn;
      EXPECT_NEAR(mean[2], by_v, 0.05 * slope) << incidence << " " << turn;
    }
  }
}

TEST(SteepPlane, AJumpIsNone) {
  for (const double jump_m : {0.02, 0.04, 0.06, 0.08, 0.15, 0.5}) {
    for (const double turn : {0.0, 45.0, 70.0, 90.0}) {
      for (const double ramp_px : {0.0, 1.5, 3.0}) {
        const double near = 1 / kDepth_m, far = 1 / (kDepth_m + jump_m);
        int found = 0;
        for (unsigned seed = 0; seed < 100; ++seed) {
          const PreparedDepth view = view_of(
              [&](double x, double y) {
                const double along = x * std::cos(radians(turn)) + y * std::sin(radians(turn));
                const double part = ramp_px > 0 ? std::clamp(along / ramp_px + 0.5, 0.0, 1.0) : along > 0;
                return near + part * (far - near);
              },
              0, seed);
          found += steep_plane_at(view, kFirst, kFirst, kFocal, {}).has_value();
        }
        EXPECT_LE(found, 1) << jump_m << " m, turned by " << turn << ", over " << ramp_px << " pixels";
      }
    }
  }
}

TEST(SteepPlane, NoneAtTheBorderAndWhereLittleIsMeasured) {
  const double slope = std::tan(radians(82)) / kTangentBySlope;
  PreparedDepth view = view_of([&](double x, double) { return 1 / kDepth_m + slope * x; }, 0, 1);
  EXPECT_TRUE(steep_plane_at(view, kFirst, kFirst, kFocal, {}));
  EXPECT_FALSE(steep_plane_at(view, 2, kFirst, kFocal, {}));
  EXPECT_FALSE(steep_plane_at(view, kFirst, 12, kFocal, {}));
  for (int v = 0; v < kEdge; ++v)
    for (int u = 10; u < kEdge; ++u) view.inverse_depth[static_cast<std::size_t>(v * kEdge + u)] = 0;
  EXPECT_FALSE(steep_plane_at(view, kFirst, kFirst, kFocal, {}));
}

}  // namespace
}  // namespace lumigraft::reconstruct
