// One strong light in nine spherical harmonics.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <vector>

#include "reconstruct/math/spherical_harmonics.h"
#include "tests/sweeps/sweep.h"

namespace lumigraft::test {
namespace {

constexpr double kPi = std::numbers::pi;

/// Uniform directions over the sphere (Swinbank & Purser 2006).
Eigen::Vector3f direction(int i, int count) {
  const double z = 1 - (2 * i + 1.0) / count, s = std::sqrt(1 - z * z), phi = 2.399963229728653 * i;
  return Eigen::Vector3d(s * std::cos(phi), s * std::sin(phi), z).cast<float>();
}

reconstruct::Sh9 project(const std::function<double(const Eigen::Vector3f&)>& radiance) {
  constexpr int count = 20000;
  reconstruct::Sh9 sum;
  sum.fill(Eigen::Vector3f::Zero());
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3f w = direction(i, count);
    const auto basis = reconstruct::sh_basis(w);
    const double light = radiance(w) * 4 * kPi / count;
    for (std::size_t k = 0; k < 9; ++k) sum[k] += Eigen::Vector3f::Constant(static_cast<float>(light * basis[k]));
  }
  return sum;
}

// A uniform sky of radiance 1 and a lamp of growing size with ten times its irradiance. Nine coefficients of both
// together ring: on the far side the sky turns negative, and planes there receive wrong irradiance. With the lamp
// extracted first, as the light stage does, nothing rings. Reference: irradiance by quadrature, over planes of all
// directions.
TEST(HarmonicsSweep, OneStrongLight) {
  Sweep sweep{.stem = "harmonics-ringing",
              .title = "An even sky and one strong lamp in nine harmonics",
              .x_label = "angular radius of the lamp, degrees",
              .y_label = "of the largest irradiance",
              .x = {2, 5, 10, 20, 40, 60},
              .curves = {{"worst plane, all in one"}, {"worst plane, lamp apart"}, {"least radiance, all in one"}}};
  constexpr int planes = 400, rays = 4000;
  for (const double degrees : sweep.x) {
    const Eigen::Vector3f at = Eigen::Vector3f(0.3f, -0.5f, 0.7f).normalized();
    const double cosine = std::cos(degrees * kPi / 180), sr = 2 * kPi * (1 - cosine), lamp = 10 * kPi / sr;
    const auto sky = [](const Eigen::Vector3f&) { return 1.0; };
    // A lamp narrower than the quadrature's step is reduced to its centre with all its light.
    reconstruct::Sh9 together = project(sky);
    const reconstruct::Sh9 apart = together;
    const auto disc = [&](int i) {
      const double z = 1 - (1 - cosine) * (i + 0.5) / rays, s = std::sqrt(1 - z * z), phi = 2.399963229728653 * i;
      const Eigen::Vector3f x = at.unitOrthogonal(), y = at.cross(x);
      return Eigen::Vector3f(static_cast<float>(s * std::cos(phi)) * x + static_cast<float>(s * std::sin(phi)) * y +
                             static_cast<float>(z) * at);
    };
    for (int i = 0; i < rays; ++i) {
      const auto basis = reconstruct::sh_basis(disc(i));
      for (std::size_t k = 0; k < 9; ++k) {
        together[k] += Eigen::Vector3f::Constant(static_cast<float>(lamp * sr / rays * basis[k]));
      }
    }
    double worst = 0, worst_apart = 0, min_value = 0, largest = 0;
    for (int p = 0; p < planes; ++p) {
      const Eigen::Vector3f n = direction(p, planes);
      double by_lamp = 0;
      for (int i = 0; i < rays; ++i) by_lamp += lamp * sr / rays * std::max(n.dot(disc(i)), 0.0f);
      const double want = kPi + by_lamp;
      largest = std::max(largest, want);
      worst = std::max(worst, std::abs(reconstruct::sh_irradiance(together, n).x() - want));
      worst_apart = std::max(worst_apart, std::abs(reconstruct::sh_irradiance(apart, n).x() + by_lamp - want));
      min_value = std::min(min_value, double{reconstruct::sh_radiance(together, n).x()});
    }
    sweep.curves[0].y.push_back(worst / largest);
    sweep.curves[1].y.push_back(worst_apart / largest);
    sweep.curves[2].y.push_back(min_value / largest);
  }
  write_sweep(sweep);
  for (std::size_t i = 0; i < sweep.x.size(); ++i) {
    EXPECT_LT(sweep.curves[0].y[i], 0.08) << "nine coefficients hold irradiance to a few per cent of its largest";
    EXPECT_LT(sweep.curves[1].y[i], 0.001);
  }
  EXPECT_LT(*std::min_element(sweep.curves[2].y.begin(), sweep.curves[2].y.end()), -0.05) << "it rings";
}

// The residual of an undetected lamp: a small bright spot under a sky that gets weaker. Its nine coefficients give
// negative irradiance on planes that face away. A window, a weight per band (Sloan 2008, "Stupid Spherical Harmonics
// (SH) Tricks"), reduces this but also flattens planes that face the spot. All users of irradiance clamp it at zero
// instead, at no cost: without a window, the coefficients are the best three-band approximation of irradiance (the
// clamped cosine scales each band), and clamping negative values can only reduce the error of a non-negative quantity.
TEST(HarmonicsSweep, CutAtNothingIsNearerThanAnyWindow) {
  Sweep sweep{.stem = "harmonics-window",
              .title = "A small bright spot in nine harmonics, under an even sky",
              .x_label = "irradiance by the sky, of that by the spot",
              .y_label = "RMS over planes, of the irradiance's",
              .x = {0.001, 0.01, 0.02, 0.05, 0.1, 0.2},
              .curves = {{"as projected"}, {"cut at nothing, as used"}, {"best window without negative planes"}},
              .logarithmic = true,
              .max = 0.1};
  constexpr int planes = 500, steps = 50;
  const Eigen::Vector3f at = Eigen::Vector3f(0.3f, -0.5f, 0.7f).normalized();
  const auto basis = reconstruct::sh_basis(at);
  for (const double sky : sweep.x) {
    reconstruct::Sh9 bands[3];
    for (reconstruct::Sh9& band : bands) band.fill(Eigen::Vector3f::Zero());
    bands[0] = project([sky](const Eigen::Vector3f&) { return sky / kPi; });
    for (std::size_t k = 0; k < 9; ++k) bands[k < 1 ? 0 : k < 4 ? 1 : 2][k] += Eigen::Vector3f::Constant(basis[k]);
    std::vector<Eigen::Vector3d> by_band;
    std::vector<double> want;
    for (int p = 0; p < planes; ++p) {
      const Eigen::Vector3f n = direction(p, planes);
      by_band.emplace_back(reconstruct::sh_irradiance(bands[0], n).x(), reconstruct::sh_irradiance(bands[1], n).x(),
                           reconstruct::sh_irradiance(bands[2], n).x());
      want.push_back(sky + std::max(n.dot(at), 0.0f));
    }
    struct Fit {
      double off = 0, min_value = 1;
    };
    const auto with = [&](double first, double second, double floor) {
      Fit found;
      for (std::size_t p = 0; p < want.size(); ++p) {
        const double e = by_band[p].dot(Eigen::Vector3d(1, first, second));
        found.min_value = std::min(found.min_value, e);
        found.off += std::pow(std::max(e, floor) - want[p], 2);
      }
      return found;
    };
    double total = 0, best = std::numeric_limits<double>::max();
    for (const double e : want) total += e * e;
    for (int i = 0; i <= steps; ++i)
      for (int j = 0; j <= steps; ++j) {
        const Fit found = with(1.0 * i / steps, 1.0 * j / steps, -1);
        if (found.min_value >= 0) best = std::min(best, found.off);
      }
    const double min_value = with(1, 1, -1).min_value;
    sweep.curves[0].y.push_back(std::sqrt(with(1, 1, -1).off / total));
    sweep.curves[1].y.push_back(std::sqrt(with(1, 1, 0).off / total));
    sweep.curves[2].y.push_back(std::sqrt(best / total));
    EXPECT_LE(sweep.curves[1].y.back(), sweep.curves[0].y.back()) << sky;
    EXPECT_LE(sweep.curves[1].y.back(), sweep.curves[2].y.back()) << sky;
    EXPECT_LT(sweep.curves[1].y.back(), sweep.max) << sky;
    if (sky < 0.03) {
      EXPECT_LT(min_value, 0) << "or it proves nothing";
      EXPECT_LT(1.05 * sweep.curves[1].y.back(), sweep.curves[2].y.back()) << sky;
    }
  }
  write_sweep(sweep);
}

}  // namespace
}  // namespace lumigraft::test
