// Radiance of the room's surfaces on the sides that no camera saw.
#include "relight/gather/ray_room.h"

#include <gtest/gtest.h>

#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector3f;

constexpr float kSeen = 0.8f;  ///< radiance of the side that the camera sees, due to a lamp in front of it

/// A wall seen from the left, with a lamp on its right. `distance`: to it.
ClosedScene wall_between(std::function<float(const Vector3f&)> distance) {
  ClosedScene scene;
  scene.eye_m = {-0.7f, 0, 0.1f};
  scene.extent = {Vector3f(-0.1f, -0.4f, -0.3f), Vector3f(0.1f, 0.4f, 0.3f)};
  scene.distance = std::move(distance);
  scene.radiance = [](const Vector3f&) { return kSeen; };
  scene.sky = 0;
  scene.lamps = {lamp_at({0.6f, 0.1f, 0.2f}, 0.03f, 0.5f)};
  return scene;
}

float before(const relight::RayRoom& room, const Vector3f& from, const Vector3f& w) {
  const auto hit = room.meshes().hit(from, w, 2);
  EXPECT_TRUE(hit);
  if (!hit) return -1;
  const relight::RoomFacet* facet = room.facet(*hit);
  EXPECT_TRUE(facet);
  const relight::Rgb of_facet = room.before(*facet, from + hit->t_m * w, w), of_point = room.point(*hit, w).before;
  EXPECT_LT((of_facet - of_point).abs().maxCoeff(), 0.02f * of_point.maxCoeff()) << "on an even surface";
  return of_point[0];
}

float lit(const ClosedScene& scene, const Vector3f& at) {
  return scene.albedo / relight::kPi * irradiance(scene.lamps[0], at, Vector3f::UnitX());
}

TEST(RayRoom, AThinBoardHasTheLightOfEachSide) {
  constexpr float kHalf_m = 0.012f;
  const ClosedScene scene = wall_between([](const Vector3f& p) { return std::abs(p.x()) - kHalf_m; });
  const relight::RayRoom room(scene.scene(), {}, {});
  EXPECT_NEAR(before(room, {-0.5f, 0, 0}, Vector3f::UnitX()), kSeen, 1e-3f);
  EXPECT_NEAR(before(room, {0.5f, 0, 0}, -Vector3f::UnitX()), lit(scene, {kHalf_m, 0, 0}), 0.005f);
}

TEST(RayRoom, SurfaceWithUnknownBackHasTheLightOfEachSide) {
  const ClosedScene scene = wall_between([](const Vector3f& p) { return -p.x(); });
  const relight::RayRoom room(scene.scene(), {}, {});
  EXPECT_NEAR(before(room, {-0.5f, 0, 0}, Vector3f::UnitX()), kSeen, 1e-3f);
  EXPECT_NEAR(before(room, {0.5f, 0, 0}, -Vector3f::UnitX()), lit(scene, Vector3f::Zero()), 0.005f);
}

TEST(RayRoom, AnUnseenSideOfUnknownAlbedoHasTheMeanOfTheRoom) {
  constexpr float kHalf_m = 0.04f;
  const ClosedScene scene = wall_between([](const Vector3f& p) { return std::abs(p.x()) - kHalf_m; });
  reconstruct::Scene known = scene.scene();
  auto albedo = std::make_shared<reconstruct::AlbedoField>(*known.albedo);
  for (const auto& [key, brick] : known.albedo->bricks) {
    if (key[0] < 0) continue;
    auto unknown = std::make_shared<reconstruct::AlbedoBrick>(*brick);
    for (float& sigma : unknown->sigma) sigma = -1;
    albedo->bricks[key] = unknown;
  }
  known.albedo = albedo;
  auto light = std::make_shared<reconstruct::Illumination>(*known.illumination);
  light->probe_position_m = {-0.3f, 0, 0};
  known.illumination = light;
  const relight::RayRoom room(known, {}, {});
  EXPECT_NEAR(before(room, {0.5f, 0, 0}, -Vector3f::UnitX()), lit(scene, {kHalf_m, 0, 0}), 0.005f);
}

}  // namespace
}  // namespace lumigraft::test
