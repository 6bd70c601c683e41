// Density of photons on a plane whose irradiance is known.
#include "relight/tracing/photon_map.h"

#include <gtest/gtest.h>

#include <cmath>

#include "relight/tracing/sampler.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector3f;

/// On the plane z = 0 from above, at f(u) for uniform u.
template <typename Place>
relight::PhotonMap photons_at(int count, Place place) {
  std::vector<relight::Photon> photons;
  for (int i = 0; i < count; ++i) {
    relight::Sampler sampler(3, 0, static_cast<std::uint32_t>(i));
    const Eigen::Vector2f p = place(sampler.two());
    relight::Photon photon;
    photon.position_m = {p.x(), p.y(), 0};
    photon.power_W = relight::Rgb(1, 2, 0) / static_cast<float>(count);
    photons.push_back(photon);
  }
  return relight::PhotonMap(std::move(photons));
}

TEST(PhotonMap, EvenLightIsItsPowerOverTheArea) {
  const relight::PhotonMap map = photons_at(1 << 14, [](const Eigen::Vector2f& u) { return u; });
  for (const float x : {0.3f, 0.5f, 0.61f}) {
    const relight::Rgb found = map.irradiance({x, 0.4f, 0}, Vector3f::UnitZ());
    EXPECT_NEAR(found[0], 1, 0.1f);
    EXPECT_NEAR(found[1], 2 * found[0], 1e-3f);
    EXPECT_EQ(found[2], 0);
  }
}

TEST(PhotonMap, TheSideAwayFromTheLightIsDark) {
  const relight::PhotonMap map = photons_at(1 << 12, [](const Eigen::Vector2f& u) { return u; });
  EXPECT_EQ(map.irradiance({0.5f, 0.5f, 0}, -Vector3f::UnitZ()).maxCoeff(), 0);
  EXPECT_EQ(map.irradiance({0.5f, 0.5f, 0}, Vector3f::UnitX()).maxCoeff(), 0);
}

// A spot of Gaussian profile, dense in its middle and sparse around: the whole power is found, and the middle's
// density.
TEST(PhotonMap, ConservesPowerWhereItIsDenseAndSparse) {
  constexpr float kSigma_m = 0.02f;
  const relight::PhotonMap map = photons_at(1 << 14, [](const Eigen::Vector2f& u) {
    const float r = kSigma_m * std::sqrt(-2 * std::log(1 - u.x())), phi = 2 * 3.14159265f * u.y();
    return Eigen::Vector2f(r * std::cos(phi), r * std::sin(phi));
  });
  constexpr int kSteps = 200;
  constexpr float kHalf_m = 0.2f, kStep_m = 2 * kHalf_m / kSteps;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    for (int k = 0; k < kSteps; ++k) {
      const Vector3f p((static_cast<float>(i) + 0.5f) * kStep_m - kHalf_m,
                       (static_cast<float>(k) + 0.5f) * kStep_m - kHalf_m, 0);
      sum += static_cast<double>(map.irradiance(p, Vector3f::UnitZ())[0] * kStep_m * kStep_m);
    }
  }
  EXPECT_NEAR(sum, 1, 0.005);
  const float peak = 1 / (2 * 3.14159265f * kSigma_m * kSigma_m);
  EXPECT_NEAR(map.irradiance(Vector3f::Zero(), Vector3f::UnitZ())[0], peak, 0.1f * peak);
}

TEST(PhotonMap, CoincidingAndSinglePhotonsHaveFiniteDensities) {
  const relight::PhotonMap one = photons_at(1, [](const Eigen::Vector2f&) { return Eigen::Vector2f::Zero(); });
  EXPECT_TRUE(one.irradiance(Vector3f::Zero(), Vector3f::UnitZ()).allFinite());
  const relight::PhotonMap many = photons_at(300, [](const Eigen::Vector2f&) { return Eigen::Vector2f::Zero(); });
  EXPECT_TRUE(many.irradiance(Vector3f::Zero(), Vector3f::UnitZ()).allFinite());
  EXPECT_TRUE(relight::PhotonMap().irradiance(Vector3f::Zero(), Vector3f::UnitZ()).isZero());
}

}  // namespace
}  // namespace lumigraft::test
