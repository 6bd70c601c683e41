#include "reconstruct/lamps/lamp_reflections.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/reconstruct/albedo/albedo_room.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

const Vector3f kProbe(0.1f, -0.2f, 0.8f);
const Vector3f kLamp(-4, 1, 2.5f);  // 4 m away: its image lies on the floor beyond the known part of it

PointLight light_at(const Vector3f& position, float irradiance) {
  PointLight light;
  light.direction = (position - kProbe).normalized();
  light.irradiance = Vector3f::Constant(irradiance);
  light.angular_radius_rad = 0.01f;
  return light;
}
Vector3f in_floor(const Vector3f& position) { return {position.x(), position.y(), -position.z()}; }

/// How many lamps are left of `lights` over a floor of which a square around the tag is known.
std::size_t left_of(std::vector<PointLight> lights, bool floor = true) {
  const TestRoom room;
  DistanceField field = room.field();
  if (!floor) field.bricks.clear();
  Illumination illumination = room.illumination();
  illumination.probe_position_m = kProbe;
  illumination.lights = std::move(lights);
  return without_reflections(illumination, field, FieldRays(field)).lights.size();
}

TEST(LampReflections, ImageOfALampInTheFloorBeyondItsKnownPartIsRemoved) {
  const PointLight lamp = light_at(kLamp, 1);
  EXPECT_EQ(left_of({lamp, light_at(in_floor(kLamp), 0.3f)}), 1u);
  EXPECT_EQ(left_of({lamp, light_at(in_floor(kLamp), 0.3f)}, false), 2u) << "no floor is known";
  PointLight clipped = lamp;
  clipped.clipped = true;
  EXPECT_EQ(left_of({clipped, light_at(in_floor(kLamp), 2)}), 1u) << "the lamp's power is a lower bound";
}

TEST(LampReflections, ALampBelowTheProbeThatIsNoImageStays) {
  const PointLight lamp = light_at(kLamp, 1);
  EXPECT_EQ(left_of({lamp, light_at(in_floor(kLamp), 2)}), 2u) << "brighter than what it would reflect";
  EXPECT_EQ(left_of({lamp, light_at(in_floor(kLamp + Vector3f(0.3f, 1, 0)), 0.3f)}), 2u) << "elsewhere";
  EXPECT_EQ(left_of({lamp, light_at({-4, 1, 0.3f}, 0.3f)}), 2u) << "a lamp on a low table, not as steep as an image";
}

}  // namespace
}  // namespace lumigraft::reconstruct
