#include "server/truth/oracle.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <numbers>

#include "capture/error.h"
#include "server/truth/truth.h"

namespace lumigraft::server {
namespace {

capture::FisheyeCamera looking_up() {
  capture::FisheyeCamera camera;
  camera.model.kind = capture::CameraModel::Kind::equidistant;
  camera.model.width = camera.model.height = 200;
  camera.model.fx = camera.model.fy = 60;
  camera.model.cx = camera.model.cy = 99.5;
  camera.model.fov_rad = std::numbers::pi;
  return camera;
}

TrueLamp bulb(const Eigen::Vector3d& centre_m) {
  TrueLamp lamp;
  lamp.centre_m = centre_m;
  lamp.radius_m = 0.1;
  lamp.radiance = Eigen::Vector3d(100, 50, 25);
  return lamp;
}

reconstruct::PointLight found_along(const Eigen::Vector3f& direction, int id) {
  reconstruct::PointLight light;
  light.id = id;
  light.direction = direction.normalized();
  light.irradiance = Eigen::Vector3f::Constant(1e-3f);
  return light;
}

TEST(Oracle, Parts) {
  EXPECT_FALSE(parse_oracle_parts("").any());
  const OracleParts parts = parse_oracle_parts("pose,albedo");
  EXPECT_TRUE(parts.pose && parts.albedo && !parts.light && !parts.geometry);
  EXPECT_THROW(parse_oracle_parts("pose,colour"), capture::InputError);
}

TEST(Oracle, ATrueLampTakesThePlaceOfItsPicture) {
  reconstruct::Illumination split;
  split.lights = {found_along({0.02f, 0, 1}, 3), found_along({1, 0, 0.3f}, 5)};
  const reconstruct::Illumination light = with_true_lamps(split, {bulb({0, 0, 2})}, {}, looking_up());
  ASSERT_EQ(light.lights.size(), 2u);
  const reconstruct::PointLight& lamp = light.lights[0];
  EXPECT_EQ(lamp.id, 3);
  ASSERT_TRUE(lamp.distance_known);
  EXPECT_NEAR(lamp.intensity.x(), 100 * std::numbers::pi * 0.01, 1e-5);  // L π r²
  EXPECT_NEAR(lamp.irradiance.x(), lamp.intensity.x() / 4, 1e-6);
  EXPECT_EQ(light.lights[1].id, 5) << "what is no lamp stays as it was found";
}

TEST(Oracle, LampsOutOfViewAreAddedThoseInTheRemainderAreNot) {
  const reconstruct::Illumination light = with_true_lamps({}, {bulb({0, 0, 2}), bulb({0, 1, -2})}, {}, looking_up());
  ASSERT_EQ(light.lights.size(), 1u);
  EXPECT_LT(light.lights[0].position_m.z(), 0);
}

TEST(Oracle, AFlatLampShinesByItsCosine) {
  TrueLamp panel = bulb({0, 0, 2});
  panel.normal = -Eigen::Vector3d::UnitZ();
  panel.area_m2 = 0.5;
  EXPECT_NEAR(panel.seen_area_m2({0, 0, 0}), 0.5, 1e-12);
  EXPECT_NEAR(panel.seen_area_m2({2, 0, 0}), 0.5 * std::sqrt(0.5), 1e-12);
  EXPECT_EQ(panel.seen_area_m2({0, 0, 3}), 0.0) << "from behind";
}

TEST(Truth, AStillSessionHasOneFolder) {
  const std::filesystem::path session =
      std::filesystem::path(testing::TempDir()) / ("lumigraft-truth-" + std::to_string(getpid()));
  std::filesystem::create_directories(session / "truth/000000");
  EXPECT_EQ(truth_folder(session, 7), session / "truth/000000");
  std::filesystem::create_directories(session / "truth/000001");
  EXPECT_EQ(truth_folder(session, 7), session / "truth/000007");
  EXPECT_THROW(read_true_pose(session / "truth/000007/pose.json"), capture::InputError);
  std::ofstream(session / "truth/000000/pose.json") << "{\"T_tag_from_camera\": [[1, 0";
  EXPECT_THROW(read_true_pose(session / "truth/000000/pose.json"), capture::InputError);
}

}  // namespace
}  // namespace lumigraft::server
