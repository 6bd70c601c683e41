#include "tests/bench/comparators/room_model.h"

#include <gtest/gtest.h>

#include "relight/objects/solid_voxels.h"
#include "tests/relight/reference/reference_rooms.h"

namespace lumigraft::comparators {
namespace {

using namespace lumigraft::test;

double area_m2(const relight::Model& model) {
  double sum = 0;
  for (std::size_t i = 0; i < model.indices.size(); i += 3) {
    const Eigen::Vector3f &a = model.positions_m[model.indices[i]], &b = model.positions_m[model.indices[i + 1]],
                          &c = model.positions_m[model.indices[i + 2]];
    sum += 0.5 * (b - a).cross(c - a).norm();
  }
  return sum;
}

TEST(RoomModel, IsWhatLiesInTheBox) {
  auto scene = std::make_shared<relight::ReferenceScene>();
  relight::Material green = lambert(0.3f);
  green.base_color = {0.1f, 0.6f, 0.2f};
  scene->real = {square(1, 0, green), square(1, 5, lambert(0.5f))};
  const auto room =
      room_model(relight::TraceWorld(scene), {Eigen::Vector3f(-0.25f, -2, -1), Eigen::Vector3f(0.5f, 0.5f, 1)}, 0.1f);
  EXPECT_NEAR(area_m2(*room), 0.75 * 1.5, 1e-5);
  for (const Eigen::Vector3f& p : room->positions_m) {
    EXPECT_TRUE(p.x() >= -0.2501f && p.x() <= 0.5001f && p.y() >= -1.0001f && p.y() <= 0.5001f) << p.transpose();
    EXPECT_NEAR(p.z(), 0, 1e-4);
  }
  for (const Eigen::Vector3f& color : room->colors) EXPECT_TRUE(color.isApprox(green.base_color, 1e-3f));
}

// A closed room must not count as a solid, whose inside would be its air.
TEST(RoomModel, WallsAreShells) {
  auto scene = std::make_shared<relight::ReferenceScene>();
  scene->real = {mesh_of(inside_out(box({-1, -1, 0}, {1, 1, 2})), lambert(0.5f))};
  const auto room =
      room_model(relight::TraceWorld(scene), {Eigen::Vector3f(-3, -3, -3), Eigen::Vector3f(3, 3, 3)}, 0.5f);
  EXPECT_NEAR(area_m2(*room), 24, 1e-3);
  const relight::ObjectSolid solid(*room);
  for (std::uint32_t t = 0; t < room->indices.size() / 3; ++t) EXPECT_FALSE(solid.is_solid(solid.component(t))) << t;
}

}  // namespace
}  // namespace lumigraft::comparators
