#include "capture/camera/camera_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace lumigraft::capture {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;

CameraModel pinhole(const std::array<double, 5>& distortion) {
  CameraModel m;
  m.width = 640;
  m.height = 480;
  m.fx = 525.0;
  m.fy = 520.0;
  m.cx = 319.5;
  m.cy = 239.5;
  m.distortion = distortion;
  return m;
}

CameraModel fisheye(CameraModel::Kind kind, double fov_degrees) {
  CameraModel m;
  m.kind = kind;
  m.width = 512;
  m.height = 512;
  m.fx = m.fy = 120.0;
  m.cx = 255.5;
  m.cy = 255.5;
  m.fov_rad = fov_degrees * kPi / 180.0;
  if (kind == CameraModel::Kind::kannala_brandt) {
    m.fy = 123.0;
    m.k = {-0.02, 0.003, -0.0011, 0.0001};
  }
  return m;
}

/// Angle between unit vectors, also accurate for small angles, unlike acos of the dot product.
double angle(const Vector3d& a, const Vector3d& b) { return 2.0 * std::asin(std::min(1.0, 0.5 * (a - b).norm())); }

/// Checks project(unproject(pixel)) = pixel in the image and around it, and the inverse.
void expect_inverse(const CameraModel& m) {
  int seen = 0;
  for (double v = -20; v < m.height + 20; v += 7.3) {
    for (double u = -20; u < m.width + 20; u += 7.7) {
      const auto direction = m.unproject({u, v});
      if (!direction) {
        continue;
      }
      ++seen;
      EXPECT_NEAR(direction->norm(), 1.0, 1e-14);
      const auto pixel = m.project(3.7 * *direction);
      ASSERT_TRUE(pixel) << u << " " << v;
      EXPECT_LT((*pixel - Vector2d(u, v)).norm(), 1e-9) << u << " " << v;
      const auto again = m.unproject(*pixel);
      ASSERT_TRUE(again);
      EXPECT_LT(angle(*again, *direction), 1e-9);
    }
  }
  EXPECT_GT(seen, 400);
}

TEST(CameraModel, PinholeIsInverse) { expect_inverse(pinhole({})); }

TEST(CameraModel, PinholeWithDistortionIsInverse) {
  expect_inverse(pinhole({0.19, -0.55, 0.0012, -0.0009, 0.47}));   // colour camera of a Kinect
  expect_inverse(pinhole({-0.28, 0.07, 0.0005, 0.0002, -0.004}));  // barrel, wide angle
  expect_inverse(pinhole({0.02, 0.0, 0.01, -0.02, 0.0}));
}

TEST(CameraModel, EquidistantIsInverse) {
  for (const double fov : {90.0, 180.0, 220.0, 359.0}) {
    expect_inverse(fisheye(CameraModel::Kind::equidistant, fov));
  }
}

TEST(CameraModel, KannalaBrandtIsInverse) {
  for (const double fov : {90.0, 180.0, 200.0}) {
    expect_inverse(fisheye(CameraModel::Kind::kannala_brandt, fov));
  }
}

TEST(CameraModel, PinholeFollowsItsFormula) {
  const CameraModel m = pinhole({0.1, 0.02, 0.003, 0.004, 0.005});
  const double x = 0.3;
  const double y = -0.2;
  const double s = x * x + y * y;
  const double radial = 1 + 0.1 * s + 0.02 * s * s + 0.005 * s * s * s;
  const auto pixel = m.project({2 * x, 2 * y, 2});
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x(), 319.5 + 525 * (x * radial + 2 * 0.003 * x * y + 0.004 * (s + 2 * x * x)), 1e-10);
  EXPECT_NEAR(pixel->y(), 239.5 + 520 * (y * radial + 0.003 * (s + 2 * y * y) + 2 * 0.004 * x * y), 1e-10);
}

TEST(CameraModel, FisheyesFollowTheirFormulas) {
  const double theta = 1.2;
  const double phi = 0.7;
  const Vector3d d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
  const auto e = fisheye(CameraModel::Kind::equidistant, 190).project(d);
  ASSERT_TRUE(e);
  EXPECT_NEAR(e->x(), 255.5 + 120 * theta * std::cos(phi), 1e-10);
  EXPECT_NEAR(e->y(), 255.5 + 120 * theta * std::sin(phi), 1e-10);
  const CameraModel kb = fisheye(CameraModel::Kind::kannala_brandt, 190);
  const double r = theta + kb.k[0] * std::pow(theta, 3) + kb.k[1] * std::pow(theta, 5) + kb.k[2] * std::pow(theta, 7) +
                   kb.k[3] * std::pow(theta, 9);
  const auto p = kb.project(d);
  ASSERT_TRUE(p);
  EXPECT_NEAR(p->x(), 255.5 + 120 * r * std::cos(phi), 1e-10);
  EXPECT_NEAR(p->y(), 255.5 + 123 * r * std::sin(phi), 1e-10);
}

TEST(CameraModel, NothingBeyondTheFieldOfView) {
  EXPECT_FALSE(pinhole({}).project({0, 0, -1}));
  EXPECT_FALSE(pinhole({}).project({1, 0, 0}));
  EXPECT_FALSE(pinhole({}).project({std::numeric_limits<double>::quiet_NaN(), 0, 1}));
  for (const auto kind : {CameraModel::Kind::equidistant, CameraModel::Kind::kannala_brandt}) {
    const CameraModel m = fisheye(kind, 190);
    const double edge = 95.0 * kPi / 180.0;
    const auto at = [](double theta) { return Vector3d(std::sin(theta), 0, std::cos(theta)); };
    EXPECT_TRUE(m.project(at(edge - 1e-6)));
    EXPECT_FALSE(m.project(at(edge + 1e-6)));
    EXPECT_FALSE(m.project({0, 0, -1}));
    EXPECT_FALSE(m.project({0, 0, 0}));
    const double radius = m.project(at(edge - 1e-9))->x() - m.cx;
    EXPECT_TRUE(m.unproject({m.cx + radius - 1e-3, m.cy}));
    EXPECT_FALSE(m.unproject({m.cx + radius + 1e-3, m.cy}));
    EXPECT_FALSE(m.unproject({0, 0})) << "the corner lies outside the image circle";
    EXPECT_EQ(m.solid_angle_sr(0, 0), 0.0);
    EXPECT_EQ(*m.project({0, 0, 2}), Vector2d(m.cx, m.cy));
    EXPECT_NEAR(m.unproject({m.cx, m.cy})->z(), 1.0, 1e-15);
  }
}

TEST(CameraModel, NothingBeyondTheFold) {
  // r (1 - 0.3 r²) increases up to r² = 1/0.9 and then decreases.
  const CameraModel m = pinhole({-0.3, 0, 0, 0, 0});
  const double fold = std::sqrt(1.0 / 0.9);
  EXPECT_TRUE(m.project({fold - 1e-6, 0, 1}));
  EXPECT_FALSE(m.project({fold + 1e-6, 0, 1}));
  EXPECT_FALSE(m.project({3.0, 0, 1}));
  const double largest = fold * (1 - 0.3 * fold * fold);
  EXPECT_TRUE(m.unproject({m.cx + m.fx * (largest - 1e-6), m.cy}));
  EXPECT_FALSE(m.unproject({m.cx + m.fx * (largest + 1e-6), m.cy}));

  // θ - 0.1 θ³ increases up to θ = √(1/0.3).
  CameraModel kb = fisheye(CameraModel::Kind::kannala_brandt, 360);
  kb.k = {-0.1, 0, 0, 0};
  const double theta = std::sqrt(1.0 / 0.3);
  EXPECT_TRUE(kb.project({std::sin(theta - 1e-6), 0, std::cos(theta - 1e-6)}));
  EXPECT_FALSE(kb.project({std::sin(theta + 1e-6), 0, std::cos(theta + 1e-6)}));
  EXPECT_FALSE(kb.project({std::sin(3.0), 0, std::cos(3.0)}));
  // A polynomial that decreases and increases again: directions beyond the fold have no pixel.
  kb.k = {-0.6, 0.12, 0, 0};
  EXPECT_TRUE(kb.project({std::sin(0.8), 0, std::cos(0.8)}));
  EXPECT_FALSE(kb.project({std::sin(2.9), 0, std::cos(2.9)}));
}

TEST(CameraModel, SolidAnglesOfAFisheyeSumToTheSphericalCap) {
  for (const double fov : {90.0, 180.0, 190.0}) {
    const double cap = 2.0 * kPi * (1.0 - std::cos(0.5 * fov * kPi / 180.0));
    for (const auto kind : {CameraModel::Kind::equidistant, CameraModel::Kind::kannala_brandt}) {
      const CameraModel m = fisheye(kind, fov);
      double sum = 0.0;
      for (int v = 0; v < m.height; ++v) {
        for (int u = 0; u < m.width; ++u) {
          sum += m.solid_angle_sr(u, v);
        }
      }
      EXPECT_NEAR(sum / cap, 1.0, 2e-5) << fov;
    }
  }
}

TEST(CameraModel, SolidAnglesOfAPinholeSumToThePyramid) {
  CameraModel m = pinhole({});
  m.width = 101;
  m.height = 51;
  m.fx = m.fy = 60.0;
  m.cx = 50.0;
  m.cy = 25.0;
  double sum = 0.0;
  for (int v = 0; v < m.height; ++v) {
    for (int u = 0; u < m.width; ++u) {
      sum += m.solid_angle_sr(u, v);
    }
  }
  // Centred rectangle a × b at distance 1: 4 atan(ab / 4 / √(1 + a²/4 + b²/4)).
  const double a = 101.0 / 60.0;
  const double b = 51.0 / 60.0;
  EXPECT_NEAR(sum, 4.0 * std::atan(a * b / 4.0 / std::sqrt(1.0 + a * a / 4.0 + b * b / 4.0)), 1e-12);
}

TEST(CameraModel, SolidAngleOfAnEquidistantPixelIsSinThetaOverR) {
  const CameraModel m = fisheye(CameraModel::Kind::equidistant, 190);
  for (const int u : {256, 300, 400, 440}) {
    const double theta = std::hypot(u - m.cx, 200 - m.cy) / m.fx;
    EXPECT_NEAR(m.solid_angle_sr(u, 200) * m.fx * m.fx * theta / std::sin(theta), 1.0, 2e-5);
  }
}

}  // namespace
}  // namespace lumigraft::capture
