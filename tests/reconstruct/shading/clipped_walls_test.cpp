// A wall next to a lamp, so bright that the fish-eye image clips on it.
#include "reconstruct/shading/clipped_walls.h"

#include <gtest/gtest.h>

#include <cmath>

#include "reconstruct/light/environment.h"
#include "tests/reconstruct/albedo/albedo_room.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

constexpr float kAlbedo = 0.5f;

PointLight lamp_by_the_wall() {
  PointLight lamp;
  lamp.position_m = {-0.6f, 0.2f, 0.9f};
  lamp.intensity = {0.6f, 0.5f, 0.4f};
  lamp.distance_known = true;
  lamp.radius_m = 0.02f;
  return lamp;
}

Enclosure room(bool measured) {
  Enclosure result;
  result.sides = {{{1, 0, 0}, 1, measured},  {{-1, 0, 0}, 1, false}, {{0, 1, 0}, 1.2f, false},
                  {{0, -1, 0}, 1.4f, false}, {{0, 0, 1}, 0, false},  {{0, 0, -1}, 2, false}};
  return result;
}

/// The wall at x = -1 lit by the lamp; everything else is black.
Illumination seen(const PointLight& lamp) {
  Illumination light;
  light.probe_position_m = {0.3f, 0.1f, 0.03f};
  light.environment.radiance = capture::Image<float>(128, 64, 3);
  const Enclosure walls = room(true);
  for (int v = 0; v < 64; ++v) {
    for (int u = 0; u < 128; ++u) {
      const Vector3f direction = environment_direction(u, v, 128, 64);
      const auto exit = walls.leave(light.probe_position_m, direction);
      if (exit->side != 0) continue;
      const Vector3f way = lamp.position_m - light.probe_position_m - exit->distance_m * direction;
      const float arriving = way.normalized().x() / way.squaredNorm();
      Eigen::Map<Vector3f>(&light.environment.radiance.at(u, v, 0)) = kAlbedo / kTestPi * arriving * lamp.intensity;
    }
  }
  light.environment_sh = project_sh(light.environment);
  return light;
}

void clip(Illumination& light, float end) {
  light.environment.clipped = capture::Image<std::uint8_t>(128, 64, 1);
  for (std::size_t i = 0; i < light.environment.clipped.data.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      float& value = light.environment.radiance.data[3 * i + c];
      if (value > end) light.environment.clipped.data[i] = 1;
      value = std::min(value, end);
    }
  }
}

TEST(ClippedWalls, WallNextToALampGetsItsTrueRadiance) {
  const PointLight lamp = lamp_by_the_wall();
  const Illumination exact = seen(lamp);
  const DistanceField nothing;
  const FieldRays rays(nothing);
  const MetalMask metal{capture::Session()};
  const auto energy = [](const Illumination& light) { return light.environment_sh[0].sum(); };
  Illumination clipped = exact;
  clip(clipped, 0.1f);
  clipped.environment_sh = project_sh(clipped.environment);
  ASSERT_LT(energy(clipped) / energy(exact), 0.75);

  Illumination raised = clipped;
  const Enclosure measured = room(true);
  raise_clipped(raised, {lamp}, &measured, nothing, rays, metal);
  EXPECT_NEAR(energy(raised) / energy(exact), 1, 0.05);

  // The position of the wall is a guess: nothing is raised.
  Illumination kept = clipped;
  const Enclosure guess = room(false);
  raise_clipped(kept, {lamp}, &guess, nothing, rays, metal);
  EXPECT_EQ(kept.environment.radiance.data, clipped.environment.radiance.data);
}

}  // namespace
}  // namespace lumigraft::reconstruct
