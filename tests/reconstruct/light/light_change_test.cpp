#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {
namespace {

PointLight lamp(int id, float irradiance, float angle_rad = 0) {
  PointLight result;
  result.id = id;
  result.direction = {std::sin(angle_rad), 0, std::cos(angle_rad)};
  result.irradiance.setConstant(irradiance);
  return result;
}

Illumination light_of(std::vector<PointLight> lamps, float environment = 0) {
  Illumination light;
  light.lights = std::move(lamps);
  // Irradiance of a constant environment of radiance L is π L, and its first coefficient 2 √π L.
  light.environment_sh[0].setConstant(environment * 2 / std::sqrt(std::numbers::pi_v<float>));
  return light;
}

TEST(LightChange, OfEqualLightIsZero) {
  const Illumination light = light_of({lamp(1, 2), lamp(2, 1)}, 0.5f);
  EXPECT_EQ(relative_change(light, light), 0);
  EXPECT_EQ(relative_change({}, {}), 0);
}

TEST(LightChange, CountsWhatALampGivesOfAllLight) {
  const Illumination both = light_of({lamp(1, 3), lamp(2, 1)}, 1), one = light_of({lamp(1, 3)}, 1);
  EXPECT_NEAR(relative_change(one, both), 1.0 / 5, 1e-3);
  EXPECT_NEAR(relative_change(both, one), 1.0 / 5, 1e-3);
  EXPECT_NEAR(relative_change(light_of({lamp(1, 3)}, 0.5f), one), 0.5 / 4, 1e-3) << "the environment dims";
}

TEST(LightChange, CountsATurnByTheVector) {
  const float angle = 0.2f;
  EXPECT_NEAR(relative_change(light_of({lamp(1, 2, angle)}), light_of({lamp(1, 2)})), 2 * std::sin(angle / 2), 1e-4);
}

}  // namespace
}  // namespace lumigraft::reconstruct
