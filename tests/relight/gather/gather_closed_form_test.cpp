// Delta final gathering in rooms with closed-form solutions.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/cube_room.h"

namespace lumigraft::test {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

relight::RelitPicture relit_by_rays(const ClosedScene& scene, const relight::Plan& plan) {
  relight::RayRenderer renderer(scene.session());
  return scene.relit(renderer, plan);
}

// A ball occludes cos · (r / d)² of a uniform sky from a plane that does not intersect it (form factor of a sphere).
TEST(RaysClosed, ABlackBallOccludesItsFractionOfAUniformSky) {
  ClosedScene scene;
  scene.exhibit.objects = {sphere_object(0.15f, {0, 0, 0.15f}, 0)};
  for (const auto& [trace_scale, bound] : {std::pair{1, 0.05}, {2, 0.08}, {4, 0.1}, {8, 0.15}, {16, 0.3}}) {
    SCOPED_TRACE(trace_scale);
    const relight::RelitPicture picture = relit_by_rays(scene, rays_plan(trace_scale, 64));
    EXPECT_TRUE(picture.warnings.empty());
    double off = 0, all = 0;
    for (int v = 0; v < scene.height; ++v) {
      for (int u = 0; u < scene.width; ++u) {
        if (picture.maps->mask.at(u, v) > 0) continue;
        const Eigen::Vector3f p = scene.on_plane(u, v);
        if (!(p.head<2>().cwiseAbs().maxCoeff() < 0.6f && p.head<2>().norm() > 0.17f)) continue;
        const float d2 = p.head<2>().squaredNorm() + 0.15f * 0.15f, cosine = 0.15f / std::sqrt(d2);
        const double expected = -0.5 * cosine * 0.15 * 0.15 / d2;
        off += std::pow(picture.maps->delta.at(u, v, 0) - expected, 2);
        all += expected * expected;
      }
    }
    EXPECT_LT(std::sqrt(off / all), bound);
  }
}

// Energy: nearly black walls receive from a ball under a lamp the reflected flux ρ Φ, and lose the blocked flux Φ = 2π
// I (1 - cos α), sin α = r/d.
TEST(RaysClosed, WallsReceiveWhatTheBallReflects) {
  constexpr float walls = 0.01f, radius = 0.1f, ball = 0.8f;
  const reconstruct::PointLight lamp = lamp_at({0.12f, -0.2f, 0.28f}, 0.002f, 30);
  CubeRoom room(0.4f, 1.05f * radius);
  room.light_walls(walls, lamp);
  room.exhibit.objects = {sphere_object(radius, {0, 0, 0}, ball)};
  const double sine = radius / lamp.position_m.norm();
  const double sent_W = lamp.intensity.x() * 2 * kPi * (1 - std::sqrt(1 - sine * sine));
  relight::RayRenderer renderer(room.session());
  double sum_W = 0, lost_W = 0;
  room.change_on_walls(renderer, rays_plan(1, 64), [&](float W) {
    sum_W += W;
    lost_W += std::min(W, 0.0f);
  });
  EXPECT_NEAR(lost_W, -sent_W, 0.03 * sent_W);  // the shadow, which the ball's own light hardly reaches
  EXPECT_NEAR(sum_W, (ball - 1) * sent_W, 0.03 * sent_W);
}

// A glow over a quarter of the sky, most of whose light is in the sky's picture: the ball's change stays the same.
TEST(RaysClosed, WhatShinesThroughALampsDirectionIsNotLost) {
  ClosedScene scene;
  scene.exhibit.objects = {sphere_object(0.15f, {0, 0, 0.15f}, 0)};
  const relight::RelitPicture before = relit_by_rays(scene, rays_plan(1, 64));
  reconstruct::PointLight glow;
  glow.direction = Eigen::Vector3f::UnitZ();
  glow.angular_radius_rad = 0.7f;
  glow.irradiance.setConstant(1e-6f);
  scene.lamps = {glow};
  const relight::RelitPicture with = relit_by_rays(scene, rays_plan(1, 64));
  double off = 0, all = 0;
  for (std::size_t i = 0; i < before.maps->delta.data.size(); ++i) {
    off += std::pow(with.maps->delta.data[i] - before.maps->delta.data[i], 2);
    all += std::pow(before.maps->delta.data[i], 2);
  }
  EXPECT_LT(std::sqrt(off / all), 0.05);
}

// Where all walls have radiance L, a black ball absorbs what left its surface before, π L A. At each bounce the
// fraction f = A / A_walls hits the ball: in total the walls lose π L A / (1 - ρ (1 - f)).
TEST(RaysClosed, LightThatIsTakenIsMissedAtEveryBounce) {
  constexpr float radiance = 0.05f, radius = 0.1f, half = 0.4f, walls = 0.9f;
  CubeRoom room(half, 1.05f * radius);
  room.albedo = walls;
  room.sky = 0;
  room.radiance = [](const Eigen::Vector3f&) { return radiance; };
  room.exhibit.objects = {sphere_object(radius, {0, 0, 0}, 0)};
  const double area = 4 * kPi * radius * radius, f = area / (24 * half * half);
  const double expected_W = -kPi * radiance * area / (1 - walls * (1 - f));
  relight::RayRenderer renderer(room.session());
  double sum_W = 0;
  room.change_on_walls(renderer, rays_plan(1, 64), [&](float W) { sum_W += W; });
  EXPECT_NEAR(sum_W, expected_W, 0.1 * std::abs(expected_W)) << "0.01 of albedo is 0.08 of this";
}

// A closed room keeps its own light: where its walls have radiance L, a white ball in it emits L and no wall changes,
// independent of light outside.
TEST(RaysClosed, SealedRoomKeepsItsLightAndTheSkyOut) {
  constexpr float radiance = 0.05f, sky = 2;
  CubeRoom scene(0.4f, 0.36f);
  scene.focal_px = 60;
  scene.albedo = 0.8f;
  scene.sky = sky;
  scene.radiance = [](const Eigen::Vector3f&) { return radiance; };
  scene.exhibit.objects = {sphere_object(0.1f, {0, 0, 0}, 1)};
  scene.eye_m = {0.3f, -0.33f, 0.2f};
  scene.look_at_m = {0, 0, 0};
  const relight::RelitPicture picture = relit_by_rays(scene, rays_plan(1, 64));
  double max_on_ball = 0, max_on_walls = 0;
  int ball = 0;
  for (int v = 0; v < scene.height; ++v) {
    for (int u = 0; u < scene.width; ++u) {
      if (picture.maps->mask.at(u, v) == 1) {
        ++ball;
        max_on_ball = std::max(max_on_ball, std::abs(picture_radiance(picture, u, v) - double{radiance}));
      } else {
        max_on_walls = std::max(max_on_walls, std::abs(double{picture.maps->delta.at(u, v)}));
      }
    }
  }
  EXPECT_GT(ball, 200);
  EXPECT_LT(max_on_ball, 0.003);  // half a code value is up to 0.002
  EXPECT_LT(max_on_walls, 0.001);
}

// An open box of infinitely thin triangles, white inside and outside, in a furnace: invisible.
TEST(RaysClosed, AnOpenWhiteShellIsInvisibleInAFurnace) {
  ClosedScene scene;
  scene.albedo = 1;
  scene.sky = 0.5f;
  scene.radiance = [](const Eigen::Vector3f&) { return 0.5f; };
  relight::VirtualObject box = box_object({-0.1f, -0.1f, 0.02f}, {0.1f, 0.1f, 0.2f}, 1);
  auto open = std::make_shared<relight::Model>(*box.model);
  open->indices.resize(open->indices.size() - 6);  // one side away
  open->parts.back().index_count -= 6;
  box.model = open;
  scene.exhibit.objects = {box};
  const relight::RelitPicture picture = relit_by_rays(scene, rays_plan(1, 128, 4));
  double worst = 0;
  for (int v = 0; v < scene.height; ++v) {
    for (int u = 0; u < scene.width; ++u) {
      const Eigen::Vector3f p = scene.on_plane(u, v);
      if (picture.maps->mask.at(u, v) == 0 && p.head<2>().cwiseAbs().maxCoeff() > 0.6f) continue;
      worst = std::max(worst, std::abs(picture_radiance(picture, u, v) / 0.5 - 1));
    }
  }
  EXPECT_LT(worst, 0.08);
}

}  // namespace
}  // namespace lumigraft::test
