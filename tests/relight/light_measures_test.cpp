#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "reconstruct/light/environment.h"
#include "relight/planner.h"

namespace lumigraft::relight {
namespace {

reconstruct::Illumination light_of(const std::function<float(const Eigen::Vector3f&)>& radiance) {
  reconstruct::Illumination light;
  light.environment.radiance = capture::Image<float>(128, 64, 3);
  for (int v = 0; v < 64; ++v)
    for (int u = 0; u < 128; ++u)
      for (int c = 0; c < 3; ++c)
        light.environment.radiance.at(u, v, c) = radiance(reconstruct::environment_direction(u, v, 128, 64));
  light.environment_sh = reconstruct::project_sh(light.environment);
  return light;
}

TEST(LightMeasures, FractionsOfLight) {
  reconstruct::Illumination light = light_of([](const Eigen::Vector3f&) { return 0.25f; });  // π W/m² in all
  for (const float irradiance : {3.0f, 1.0f}) {
    reconstruct::PointLight lamp;
    lamp.irradiance.setConstant(irradiance);
    light.lights.push_back(lamp);
  }
  const LightMeasures measures = measure_light(light);
  const float all = 4 + 3.14159f;
  EXPECT_NEAR(measures.environment_fraction, 3.14159 / all, 1e-3);
  EXPECT_NEAR(measures.bands_left_out[0], 0, 1e-3);
  EXPECT_NEAR(measures.bands_left_out[1], 0, 1e-3);
}

// Irradiance of 1 + z is pi (1 + 2/3 cos), whose slope has 2 / (3 sqrt 3) of the mean as its root mean square.
TEST(LightMeasures, LinearLightIsInTheFirstTwoBands) {
  const LightMeasures measures = measure_light(light_of([](const Eigen::Vector3f& d) { return 1 + d.z(); }));
  EXPECT_NEAR(measures.bands_left_out[0], 2 / (3 * std::sqrt(3.0)), 2e-3);
  EXPECT_NEAR(measures.bands_left_out[1], 0, 2e-3);
}

TEST(LightMeasures, NoLightHasNoFractions) {
  const LightMeasures measures = measure_light(light_of([](const Eigen::Vector3f&) { return 0.0f; }));
  EXPECT_EQ(measures.environment_fraction, 0);
  EXPECT_EQ(measures.bands_left_out[0], 0);
}

}  // namespace
}  // namespace lumigraft::relight
