#include "capture/camera/depth_noise.h"

#include <gtest/gtest.h>

namespace lumigraft::capture {
namespace {

constexpr double kFloat = 1e-9;  // m, of coefficients in float

TEST(DepthNoise, OfEachPrincipleAsPublished) {
  const double angle = std::numbers::pi / 3, oblique = angle * angle / std::pow(std::numbers::pi / 2 - angle, 2);
  const DepthNoise light = usual_noise(DepthPrinciple::structured_light);
  EXPECT_NEAR(light.sigma_m(0.4, 0), 0.0012, kFloat);
  EXPECT_NEAR(light.sigma_m(2.4, angle), 0.0012 + 0.0019 * 4 + 0.0001 / std::sqrt(2.4) * oblique, kFloat);
  EXPECT_EQ(light.sigma_m(2.4, std::numbers::pi / 19), light.sigma_m(2.4, 0)) << "below 10 degrees";
  // Fankhauser et al.: 1.5 - 0.5 z + 0.3 z^2 + 0.1 z^(3/2) theta^2 / (pi/2 - theta)^2 mm.
  const DepthNoise flight = usual_noise(DepthPrinciple::time_of_flight);
  for (const double z : {0.5, 1.0, 3.0})
    EXPECT_NEAR(flight.sigma_m(z, angle), 1e-3 * (1.5 - 0.5 * z + 0.3 * z * z + 0.1 * std::pow(z, 1.5) * oblique),
                1e-8);
  // Proportional to the square of depth where that exceeds the steps of depth.
  const DepthNoise stereo = usual_noise(DepthPrinciple::stereo);
  EXPECT_NEAR((stereo.sigma_m(4, 0) - 0.001) / (stereo.sigma_m(2, 0) - 0.001), 4, 1e-4);
  EXPECT_NEAR(stereo.sigma_m(2, 0), 0.001 + 4 * 0.08 / (447 * 0.05), 4e-4);
}

TEST(DepthNoise, ScalesAndInverts) {
  for (const auto principle :
       {DepthPrinciple::structured_light, DepthPrinciple::time_of_flight, DepthPrinciple::stereo}) {
    const DepthNoise usual = usual_noise(principle), noise = usual_noise(principle, 2);
    for (const double z : {0.5, 2.0, 4.0}) {
      EXPECT_NEAR(noise.sigma_m(z, 1) / usual.sigma_m(z, 1), 2, 1e-6);
      EXPECT_NEAR(noise.axial_sigma_m(z), noise.sigma_m(z, 0), kFloat);
      EXPECT_NEAR(noise.inverse_sigma(1 / z), noise.sigma_m(z, 0) / (z * z), kFloat);
    }
    const auto sigma_m = static_cast<float>(noise.sigma_m(3, 0));
    EXPECT_NEAR(noise.max_depth_m(sigma_m), 3, 1e-4);
    EXPECT_EQ(noise.max_depth_m(1e-4f), 0) << "no depth is so exact";
  }
}

}  // namespace
}  // namespace lumigraft::capture
