// Delta light propagation volumes in rooms with closed-form solutions. The volumes are coarse, so bounds are wider than
// for cones (closed_sky_test.cpp, closed_room_test.cpp).
#include <cmath>
#include <numbers>

#include "tests/relight/closed_form/cube_room.h"

namespace lumigraft::test {
namespace {

relight::Plan lpv_plan(int volume = 64, int bounces = 2) {
  relight::Plan plan = careful_plan(volume, bounces);
  plan.method = "dlpv";
  plan.lpv_steps = 32;
  return plan;
}

struct Floor {
  double got = 0, want = 0, squares = 0, want_squares = 0, max_off = 0;
  int count = 0;
  void add(double g, double w) {
    got += g;
    want += w;
    squares += (g - w) * (g - w);
    want_squares += w * w;
    max_off = std::max(max_off, std::abs(g - w));
    ++count;
  }
  double error() const { return std::sqrt(squares / want_squares); }
};

class ClosedLpv : public ClosedTest {};
ON_BOTH_DEVICES(ClosedLpv);

// A black ball occludes its form factor of a uniform sky: E = -π L cos θ (r/d)². Nothing else changes.
TEST_P(ClosedLpv, BlackBallTakesItsFormFactor) {
  constexpr float albedo = 0.5f, radius = 0.1f;
  for (const float height : {0.102f, 0.15f}) {
    SCOPED_TRACE(height);
    ClosedScene scene;
    scene.albedo = albedo;
    scene.sky = 1;
    scene.radiance = [](const Eigen::Vector3f&) { return albedo; };
    scene.exhibit.objects = {sphere_object(radius, {0, 0, height}, 0)};
    const relight::RelitPicture picture = relit(scene, lpv_plan(64, 1));
    Floor floor;
    for (int v = 0; v < scene.height; ++v) {
      for (int u = 0; u < scene.width; ++u) {
        const Eigen::Vector3f p = scene.on_plane(u, v);
        const float far = (p - Eigen::Vector3f(0, 0, height)).norm();
        if (picture.maps->mask.at(u, v) > 0 || p.head<2>().norm() > 0.36f) continue;
        floor.add(picture.maps->delta.at(u, v), -albedo * height / far * std::pow(radius / far, 2));
      }
    }
    EXPECT_GT(floor.count, 1000);
    EXPECT_NEAR(floor.got / floor.want, 1, 0.25);
    EXPECT_LT(floor.error(), 0.22);
  }
}

// Where sky and floor have radiance L and nothing absorbs, an object emits what it occludes: no change.
TEST_P(ClosedLpv, FurnaceStaysEven) {
  ClosedScene scene;
  scene.albedo = 1;
  scene.sky = 0.5f;
  scene.radiance = [](const Eigen::Vector3f&) { return 0.5f; };
  scene.exhibit.objects = {sphere_object(0.1f, {0, 0, 0.15f}, 1)};
  const relight::RelitPicture picture = relit(scene, lpv_plan(64, 3));
  Floor floor;
  for (int v = 0; v < scene.height; ++v) {
    for (int u = 0; u < scene.width; ++u) {
      if (picture.maps->mask.at(u, v) == 0) floor.add(picture.maps->delta.at(u, v) / 0.5, 0);
    }
  }
  EXPECT_LT(floor.max_off, 0.003);
}

// Nearly black walls receive from a ball under a lamp the reflected flux (ρ Φ, Φ the lamp's flux on the ball).
TEST_P(ClosedLpv, WallsReceiveWhatTheBallReflects) {
  constexpr float walls = 0.01f, radius = 0.1f, ball = 0.8f;
  const reconstruct::PointLight lamp = lamp_at({0.12f, -0.15f, 0.2f}, 0.002f, 30);
  CubeRoom room(0.3f, 1.05f * radius);
  room.light_walls(walls, lamp);
  room.exhibit.objects = {sphere_object(radius, {0, 0, 0}, ball)};
  const double sine = radius / lamp.position_m.norm();
  const double sent_W = lamp.intensity.x() * 2 * std::numbers::pi_v<float> * (1 - std::sqrt(1 - sine * sine));
  relight::Relighter relighter(device_, room.session());
  double change_W = 0;
  room.change_on_walls(relighter, lpv_plan(64, 1), [&](float W) { change_W += W; });
  EXPECT_NEAR(change_W + sent_W, ball * sent_W, 0.15 * sent_W);  // the shadow removes the whole flux
}

// Behind a wall nothing changes.
TEST_P(ClosedLpv, NothingGetsThroughAWall) {
  const Eigen::AlignedBox3f wall(Eigen::Vector3f(-0.5f, -0.14f, -0.1f), Eigen::Vector3f(0.5f, -0.1f, 0.45f));
  ClosedScene scene;
  scene.distance = [wall](const Eigen::Vector3f& p) { return std::min(p.z(), box_distance(wall, p)); };
  scene.extent = {Eigen::Vector3f(-0.9f, -0.9f, -0.1f), Eigen::Vector3f(0.9f, 0.9f, 0.5f)};
  scene.eye_m = {0, -0.9f, 0.35f};
  scene.look_at_m = {0, -0.3f, 0.05f};
  scene.exhibit.objects = {sphere_object(0.09f, {0, 0, 0.1f}, 0)};
  const relight::RelitPicture picture = relit(scene, lpv_plan());
  double max_off = 0;
  int count = 0;
  for (int v = 0; v < scene.height; ++v) {
    for (int u = 0; u < scene.width; ++u) {
      const Eigen::Vector3f p = scene.on_plane(u, v);
      if (p.y() > -0.15f || p.y() < -0.4f || std::abs(p.x()) > 0.2f) continue;
      max_off = std::max(max_off, std::abs(double{picture.maps->delta.at(u, v)}));
      ++count;
    }
  }
  EXPECT_GT(count, 500);
  EXPECT_LT(max_off, 0.002);  // of 0.5; without the wall it would be 0.1
}

// Doubling all light doubles all changes; everything comes from volumes that are filled once.
TEST_P(ClosedLpv, IsLinearInLightAndComputedOnce) {
  ClosedScene scene;
  scene.exhibit.objects = {sphere_object(0.1f, {0, 0, 0.12f}, 0.7f)};
  std::vector<relight::RelitPicture> pictures;
  for (const float light : {0.5f, 1.0f}) {
    scene.sky = light;
    scene.radiance = [light](const Eigen::Vector3f&) { return 0.5f * light; };
    scene.lamps = {lamp_at({0.2f, 0.1f, 0.9f}, 0.05f, light)};
    const reconstruct::Scene still = scene.scene();
    const auto runs_propagation = [](const relight::RelitPicture& picture) {
      return std::any_of(picture.passes.begin(), picture.passes.end(),
                         [](const relight::gpu::PassTime& pass) { return pass.name == "propagate"; });
    };
    relight::Relighter fresh(device_, scene.session());
    pictures.push_back(fresh.relight(scene.frame(), still, scene.exhibit, lpv_plan(32), true));
    EXPECT_TRUE(runs_propagation(pictures.back()));
    const relight::RelitPicture again = fresh.relight(scene.frame(), still, scene.exhibit, lpv_plan(32), true);
    EXPECT_FALSE(runs_propagation(again));
    EXPECT_EQ(again.srgb.data, pictures.back().srgb.data);
  }
  double max_off = 0, largest = 0;
  for (std::size_t i = 0; i < pictures[0].maps->delta.data.size(); ++i) {
    const double one = pictures[0].maps->delta.data[i], two = pictures[1].maps->delta.data[i];
    max_off = std::max(max_off, std::abs(two - 2 * one));
    largest = std::max(largest, std::abs(two));
  }
  EXPECT_GT(largest, 0.1);
  EXPECT_LT(max_off, 0.002 * largest);
}

relight::Plan lpv_plan_at(int trace_scale) {
  relight::Plan plan = lpv_plan(32);
  plan.trace_scale = trace_scale;
  return plan;
}

TEST_P(ClosedLpv, TheSameInputGivesTheSameBytes) {
  for (const int scale : {1, 4}) {
    SCOPED_TRACE(scale);
    const relight::RelitPicture first = relit(ball_under_lamp(), lpv_plan_at(scale));
    const relight::RelitPicture again = relit(ball_under_lamp(), lpv_plan_at(scale));
    EXPECT_EQ(first.srgb.data, again.srgb.data);
    EXPECT_EQ(first.maps->delta.data, again.maps->delta.data);
  }
}

TEST(ClosedLpvPictures, BothDevicesDrawTheSamePicture) {
  const ClosedScene scene = ball_under_lamp();
  for (const int scale : {1, 4}) {
    SCOPED_TRACE(scale);
    std::vector<relight::RelitPicture> pictures;
    for (const relight::gpu::Backend backend : {relight::gpu::Backend::vulkan, relight::gpu::Backend::egl}) {
      relight::Relighter relighter(relight::gpu::create_device(backend, {.validation = true}), scene.session());
      pictures.push_back(scene.relit(relighter, lpv_plan_at(scale)));
    }
    std::size_t apart = 0;
    for (std::size_t i = 0; i < pictures[0].srgb.data.size(); ++i) {
      apart += std::abs(pictures[0].srgb.data[i] - pictures[1].srgb.data[i]) > 1;
    }
    EXPECT_LE(apart, pictures[0].srgb.data.size() / 1000);
  }
}

// An object without any light within reach changes no bit, as with cones.
TEST_P(ClosedLpv, AnObjectOutOfReachChangesNoBit) {
  ClosedScene scene;
  scene.lamps = {lamp_at({0.2f, 0.1f, 0.9f}, 0.05f, 1)};
  scene.exhibit.objects = {sphere_object(0.1f, {0, -20, 0.12f}, 0.7f)};
  const relight::RelitPicture picture = relit(scene, lpv_plan(32));
  EXPECT_TRUE(picture.warnings.empty());
  EXPECT_TRUE(
      std::all_of(picture.maps->delta.data.begin(), picture.maps->delta.data.end(), [](float d) { return d == 0; }));
}

}  // namespace
}  // namespace lumigraft::test
