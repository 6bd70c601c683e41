#include "reconstruct/math/spherical_harmonics.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

namespace lumigraft::reconstruct {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// Calls f(direction, solid angle) over the sphere: midpoints in cos θ and φ.
template <typename F>
void over_sphere(F f) {
  const int rows = 200, columns = 400;
  for (int i = 0; i < rows; ++i) {
    const double z = 1 - 2 * (i + 0.5) / rows, s = std::sqrt(1 - z * z);
    for (int j = 0; j < columns; ++j) {
      const double phi = 2 * kPi * (j + 0.5) / columns;
      f(Eigen::Vector3f(s * std::cos(phi), s * std::sin(phi), z), 4 * kPi / (rows * columns));
    }
  }
}

Sh9 project(const auto& radiance) {
  std::array<Eigen::Vector3d, 9> sum;
  sum.fill(Eigen::Vector3d::Zero());
  over_sphere([&](const Eigen::Vector3f& w, double solid_angle) {
    const auto basis = sh_basis(w);
    const Eigen::Vector3f L = radiance(w);
    for (int i = 0; i < 9; ++i) sum[i] += (L * basis[i]).template cast<double>() * solid_angle;
  });
  Sh9 result;
  for (int i = 0; i < 9; ++i) result[i] = sum[i].cast<float>();
  return result;
}

TEST(SphericalHarmonics, BasisIsOrthonormal) {
  double product[9][9] = {};
  over_sphere([&](const Eigen::Vector3f& w, double solid_angle) {
    const auto basis = sh_basis(w);
    for (int i = 0; i < 9; ++i)
      for (int j = 0; j < 9; ++j) product[i][j] += double(basis[i]) * basis[j] * solid_angle;
  });
  for (int i = 0; i < 9; ++i)
    for (int j = 0; j < 9; ++j) EXPECT_NEAR(product[i][j], i == j ? 1 : 0, 3e-4) << i << " " << j;
}

TEST(SphericalHarmonics, OrderAndSignsOfTheBasis) {
  const Eigen::Vector3f d = Eigen::Vector3f(0.3f, 0.5f, 0.7f).normalized();
  const auto b = sh_basis(d);
  const float x = d.x(), y = d.y(), z = d.z();
  const float expected[9] = {0.282095f,
                             0.488603f * y,
                             0.488603f * z,
                             0.488603f * x,
                             1.092548f * x * y,
                             1.092548f * y * z,
                             0.315392f * (3 * z * z - 1),
                             1.092548f * x * z,
                             0.546274f * (x * x - y * y)};
  for (int i = 0; i < 9; ++i) EXPECT_NEAR(b[i], expected[i], 1e-6) << i;
}

TEST(SphericalHarmonics, WhiteEnvironmentGivesPiOnEveryPlane) {
  const Sh9 sh = project([](const Eigen::Vector3f&) { return Eigen::Vector3f(1, 2, 3); });
  over_sphere([&](const Eigen::Vector3f& n, double) {
    EXPECT_NEAR(sh_irradiance(sh, n).x(), kPi, 1e-3);
    EXPECT_NEAR(sh_irradiance(sh, n).z(), 3 * kPi, 3e-3);
    EXPECT_NEAR(sh_radiance(sh, n).y(), 2, 1e-3);
  });
}

TEST(SphericalHarmonics, LinearEnvironmentIsExact) {
  // L(ω) = 1 + a·ω has bands 0 and 1 only: E(n) = π + 2π/3 a·n.
  const Eigen::Vector3f a(0.2f, -0.5f, 0.3f);
  const Sh9 sh = project([&](const Eigen::Vector3f& w) { return Eigen::Vector3f::Constant(1 + a.dot(w)).eval(); });
  for (const Eigen::Vector3f& n :
       {Eigen::Vector3f(1, 0, 0), Eigen::Vector3f(0, -1, 0), Eigen::Vector3f(0, 0.6f, 0.8f)}) {
    EXPECT_NEAR(sh_irradiance(sh, n).x(), kPi + 2 * kPi / 3 * a.dot(n), 1e-3);
    EXPECT_NEAR(sh_radiance(sh, n).x(), 1 + a.dot(n), 1e-3);
  }
}

TEST(SphericalHarmonics, BandLimitedEnvironmentMatchesQuadrature) {
  const auto radiance = [](const Eigen::Vector3f& w) {
    return Eigen::Vector3f(1 + w.x() * w.y(), 1 + 0.5f * w.z() * w.z(),
                           1 + 0.4f * w.y() * w.z() - 0.3f * w.x() * w.z());
  };
  const Sh9 sh = project(radiance);
  for (const Eigen::Vector3f& v : {Eigen::Vector3f(1, 2, 3), Eigen::Vector3f(-1, 0.5f, -0.2f)}) {
    const Eigen::Vector3f n = v.normalized();
    Eigen::Vector3d quadrature = Eigen::Vector3d::Zero();
    over_sphere([&](const Eigen::Vector3f& w, double solid_angle) {
      quadrature += (radiance(w) * std::max(0.0f, n.dot(w))).cast<double>() * solid_angle;
    });
    EXPECT_LT((sh_irradiance(sh, n).cast<double>() - quadrature).norm(), 2e-3);
  }
}

}  // namespace
}  // namespace lumigraft::reconstruct
