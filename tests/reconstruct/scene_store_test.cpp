#include "reconstruct/scene_store.h"

#include <gtest/gtest.h>

#include "reconstruct/albedo_schedule.h"
#include "reconstruct/light/environment.h"

namespace lumigraft::reconstruct {
namespace {

Illumination lamp_along_x(std::uint64_t version, float irradiance) {
  Illumination light;
  light.version = version;
  light.probe_position_m = Eigen::Vector3f(0, 0, 1);
  PointLight lamp;
  lamp.id = 4;
  lamp.direction = Eigen::Vector3f::UnitX();
  lamp.irradiance = Eigen::Vector3f::Constant(irradiance);
  lamp.angular_radius_rad = 0.1f;
  light.lights.push_back(lamp);
  return light;
}

Illumination at_two_metres(Illumination light) {
  PointLight& lamp = light.lights[0];
  lamp.distance_known = true;
  lamp.position_m = light.probe_position_m + 2 * lamp.direction;
  lamp.intensity = 4 * lamp.irradiance;
  lamp.distance_log_sigma = 0.03f;
  lamp.flat = true;
  lamp.normal = {-0.8f, 0, -0.6f};
  return light;
}

// It may have been estimated while the first image arrived.
TEST(SceneStore, EstimatedLightDoesNotReplaceMeasuredLight) {
  SceneStore board;
  const auto measured = std::make_shared<const Illumination>(lamp_along_x(1, 10));
  auto estimated = std::make_shared<Illumination>(lamp_along_x(2, 8));
  estimated->from_shading = true;
  board.publish_light(estimated);
  EXPECT_EQ(board.newest().illumination, estimated);
  board.publish_light(measured);
  board.publish_light(estimated);
  EXPECT_EQ(board.newest().illumination, measured);
}

TEST(SceneStore, ConvergesWhenTheNewestFramesChangeNothing) {
  SceneStore board;
  auto field = std::make_shared<DistanceField>();
  field->version = 3;
  const auto light = std::make_shared<const Illumination>(lamp_along_x(2, 10));
  const auto publish_again = [&] {
    board.publish_field(field);
    board.publish_light(light);
  };
  const auto solve = [&](std::uint64_t field_version, std::uint64_t light_version) {
    const auto measured = std::make_shared<const Illumination>(lamp_along_x(light_version, 10));
    board.publish_solution({.albedo = std::make_shared<AlbedoField>(), .illumination = light}, field_version, measured);
  };
  EXPECT_FALSE(board.settled(board.newest()));
  publish_again();
  publish_again();
  EXPECT_FALSE(board.settled(board.newest())) << "albedo is not solved";
  solve(2, 2);
  EXPECT_FALSE(board.settled(board.newest())) << "solved for an older field";
  solve(3, 1);
  EXPECT_FALSE(board.settled(board.newest())) << "solved for older light";
  const Scene older = board.newest();
  solve(3, 2);
  EXPECT_TRUE(board.settled(board.newest()));
  EXPECT_FALSE(board.settled(older)) << "a picture of an older scene";

  field = std::make_shared<DistanceField>(*field);
  field->version = 4;
  publish_again();
  EXPECT_FALSE(board.settled(board.newest())) << "geometry learnt something";
  solve(4, 2);
  EXPECT_FALSE(board.settled(board.newest())) << "and may learn more";
  publish_again();
  EXPECT_TRUE(board.settled(board.newest()));
}

TEST(SceneStore, SolvedDistancesHoldForLaterLight) {
  SceneStore board;
  const auto measured = std::make_shared<const Illumination>(lamp_along_x(1, 10));
  board.publish_light(measured);
  const auto solved = std::make_shared<const Illumination>(at_two_metres(lamp_along_x(1, 10)));
  board.publish_solution({.albedo = std::make_shared<AlbedoField>(), .illumination = solved, .warnings = {"dim"}}, 0,
                         measured);
  EXPECT_EQ(board.newest().illumination, solved) << "the very light that was solved";
  EXPECT_EQ(board.newest().warnings, std::vector<std::string>{"dim"});

  board.publish_light(std::make_shared<const Illumination>(lamp_along_x(2, 30)));
  const Scene later = board.newest();
  const PointLight& lamp = later.illumination->lights[0];
  ASSERT_TRUE(lamp.distance_known);
  EXPECT_TRUE(lamp.position_m.isApprox(Eigen::Vector3f(2, 0, 1)));
  EXPECT_FLOAT_EQ(lamp.intensity.x(), 120);  // 30 W/m² at 2 m
  EXPECT_FLOAT_EQ(lamp.irradiance.x(), 30);
  EXPECT_NEAR(lamp.radius_m, 2 * std::tan(0.1), 1e-6);
  EXPECT_FLOAT_EQ(lamp.distance_log_sigma, 0.03f);
  EXPECT_TRUE(lamp.flat) << "a window stays one";
  EXPECT_EQ(lamp.normal, Eigen::Vector3f(-0.8f, 0, -0.6f));
  EXPECT_EQ(board.newest().illumination, later.illumination) << "made once, so that caches hold";
  EXPECT_FALSE(board.measured_light()->lights[0].distance_known);
}

TEST(SceneStore, AnUnknownLampStaysInfinitelyFar) {
  Illumination other = lamp_along_x(2, 5);
  other.lights[0].id = 9;
  const auto carried = carry_lamps(other, lamp_along_x(1, 10), at_two_metres(lamp_along_x(1, 10)));
  EXPECT_FALSE(carried->lights.at(0).distance_known);
  EXPECT_EQ(carried->lights.at(0).irradiance.x(), 5);
}

// The image gives a lower bound of a clipped lamp's power. Solving found 3 times that; the ratio is kept later.
TEST(SceneStore, AClippedLampKeepsItsGain) {
  Illumination measured = lamp_along_x(1, 10), newest = lamp_along_x(2, 11);
  Illumination solved = at_two_metres(lamp_along_x(1, 30));
  measured.lights[0].clipped = newest.lights[0].clipped = solved.lights[0].clipped = true;
  const PointLight near = carry_lamps(newest, measured, solved)->lights.at(0);
  EXPECT_FLOAT_EQ(near.irradiance.x(), 33);
  EXPECT_FLOAT_EQ(near.intensity.x(), 4 * 33);
  solved.lights[0].distance_known = false;
  EXPECT_FLOAT_EQ(carry_lamps(newest, measured, solved)->lights.at(0).irradiance.x(), 33);
  newest.lights[0].clipped = false;
  EXPECT_FLOAT_EQ(carry_lamps(newest, measured, solved)->lights.at(0).irradiance.x(), 11) << "now it is measured";
}

// A lamp that a tag places and no fish-eye sees: solving found 5 times the power that was guessed. It moves.
TEST(SceneStore, AnUnseenLampKeepsItsPowerAndItsTagsPlace) {
  Illumination measured = lamp_along_x(1, 2);
  measured.lights[0].visibility = PointLight::Visibility::dark;
  measured.lights[0].distance_known = true;
  measured.lights[0].position_m = Eigen::Vector3f(3, 0, 1);
  Illumination newest = measured, solved = measured;
  newest.version = 2;
  newest.lights[0].position_m = Eigen::Vector3f(2, 0, 1);
  solved.lights[0].irradiance *= 5;
  solved.lights[0].power_log_sigma = 0.1f;
  const PointLight lamp = carry_lamps(newest, measured, solved)->lights.at(0);
  EXPECT_EQ(lamp.position_m, newest.lights[0].position_m);
  EXPECT_FLOAT_EQ(lamp.irradiance.x(), 10);
  EXPECT_FLOAT_EQ(lamp.intensity.x(), 4 * 10);
  EXPECT_EQ(lamp.power_log_sigma, 0.1f);

  solved.lights.clear();  // off
  EXPECT_TRUE(carry_lamps(newest, measured, solved)->lights.empty());
  newest.lights[0].visibility = PointLight::Visibility::visible;  // switched on since: a lamp, and no reflection
  EXPECT_FLOAT_EQ(carry_lamps(newest, measured, solved)->lights.at(0).irradiance.x(), 2);
}

// A wall is clipped next to a lamp; solving raised it to the radiance that the lamp causes, and unseen cells with it.
TEST(SceneStore, AClippedWallStaysAsBrightAsItWasFound) {
  constexpr std::size_t kClipped = 10 * 64 + 20, kUnseen = 30 * 64 + 5, kPlain = 10 * 64 + 40;
  Illumination measured = lamp_along_x(1, 10);
  measured.environment.radiance = capture::Image<float>(64, 32, 3);
  std::fill(measured.environment.radiance.data.begin(), measured.environment.radiance.data.end(), 1.0f);
  measured.environment.clipped = capture::Image<std::uint8_t>(64, 32, 1);
  measured.environment.clipped.data[kClipped] = 1;
  measured.environment.seen = capture::Image<std::uint8_t>(64, 32, 1);
  std::fill(measured.environment.seen.data.begin(), measured.environment.seen.data.end(), std::uint8_t{1});
  measured.environment.seen.data[kUnseen] = 0;
  Illumination newest = measured, solved = at_two_metres(measured);
  newest.version = 2;
  for (const std::size_t cell : {kClipped, kUnseen, kPlain}) solved.environment.radiance.data[3 * cell] = 5;
  newest.environment.radiance.data[3 * kClipped] = 1.1f;
  const auto carried = carry_lamps(newest, measured, solved);
  const std::vector<float>& found = carried->environment.radiance.data;
  EXPECT_FLOAT_EQ(found[3 * kClipped], 5.5f);
  EXPECT_FLOAT_EQ(found[3 * kUnseen], 5);
  EXPECT_FLOAT_EQ(found[3 * kPlain], 1) << "that was measured";
  EXPECT_FLOAT_EQ(found[3 * kClipped + 1], 1);
  EXPECT_EQ(carried->environment_sh[0], project_sh(carried->environment)[0]);

  newest.environment.clipped.data[kClipped] = 0;
  EXPECT_FLOAT_EQ(carry_lamps(newest, measured, solved)->environment.radiance.data[3 * kClipped], 1.1f)
      << "now it is, too";
}

TEST(SceneStore, AReflectionStaysOne) {
  Illumination newest = lamp_along_x(2, 7), solved = lamp_along_x(1, 10);
  newest.environment.radiance = capture::Image<float>(64, 32, 3);
  solved.lights.clear();
  const auto carried = carry_lamps(newest, lamp_along_x(1, 10), solved);
  EXPECT_TRUE(carried->lights.empty());
  EXPECT_GT(carried->environment.sample(Eigen::Vector3f::UnitX()).x(), 100) << "7 W/m² in a disk of 0.1 rad";
  EXPECT_GT(carried->environment_sh[0].x(), 1);
}

}  // namespace
}  // namespace lumigraft::reconstruct
