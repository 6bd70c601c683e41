#include "reconstruct/measures.h"

#include <gtest/gtest.h>

#include <cmath>

#include "reconstruct/fusion.h"
#include "reconstruct/light_environment.h"
#include "tests/reconstruct/fusion_views.h"

namespace lumigraft {
namespace {

Illumination light_of(const std::function<float(const Eigen::Vector3f&)>& radiance) {
  Illumination light;
  light.remainder.radiance = Image<float>(128, 64, 3);
  for (int v = 0; v < 64; ++v)
    for (int u = 0; u < 128; ++u)
      for (int c = 0; c < 3; ++c) light.remainder.radiance.at(u, v, c) = radiance(environment_direction(u, v, 128, 64));
  light.remainder_sh = project_sh(light.remainder);
  return light;
}

TEST(Measures, SharesOfLight) {
  Illumination light = light_of([](const Eigen::Vector3f&) { return 0.25f; });  // π W/m² in all
  for (const float irradiance : {3.0f, 1.0f}) {
    PointLight lamp;
    lamp.irradiance.setConstant(irradiance);
    light.lights.push_back(lamp);
  }
  const LightMeasures measures = measure_light(light);
  const float all = 4 + 3.14159f;
  ASSERT_EQ(measures.lamp_share.size(), 2u);
  EXPECT_NEAR(measures.lamp_share[0], 3 / all, 1e-3);
  EXPECT_NEAR(measures.lamp_share[1], 1 / all, 1e-3);
  EXPECT_NEAR(measures.remainder_share, 3.14159 / all, 1e-3);
  EXPECT_NEAR(measures.band_share[0], 1, 1e-4);
  EXPECT_NEAR(measures.band_share[1] + measures.band_share[2], 0, 1e-4);
}

// Irradiance of 1 + z is π (1 + 2/3 cos θ): over the sphere its square is π² (1 + 4/27).
TEST(Measures, SharesOfBands) {
  const LightMeasures measures = measure_light(light_of([](const Eigen::Vector3f& d) { return 1 + d.z(); }));
  EXPECT_NEAR(measures.band_share[0], 27.0 / 31, 2e-3);
  EXPECT_NEAR(measures.band_share[1], 4.0 / 31, 2e-3);
  EXPECT_NEAR(measures.band_share[2], 0, 1e-4);
}

TEST(Measures, NoLightHasNoShares) {
  const LightMeasures measures = measure_light(light_of([](const Eigen::Vector3f&) { return 0.0f; }));
  EXPECT_EQ(measures.remainder_share, 0);
  EXPECT_EQ(measures.band_share[0], 0);
}

TEST(Measures, OfAPlaneAndABall) {
  const CameraModel camera = test::small_camera();
  FusionStage fusion(test::session_with(camera), {});
  std::shared_ptr<const DistanceField> field, before;
  for (unsigned i = 0; i < 9; ++i) {
    const auto T = test::looking_at_tag(1.0, 45 * test::kDegree, (-90 + 40.0 * i) * test::kDegree);
    before = field;
    field = fusion.fuse(test::frame_of(test::ball_on_table, camera, T, i), test::pose_at(T));
  }
  const std::vector<RoomPoint> points = room_points(*field);
  const SurfaceMeasures table = measure_surface(points, {-0.2f, -0.2f, 0}, 0.15f);
  EXPECT_GT(table.points, 30);
  EXPECT_LT(table.curvature_per_m, 0.3f);
  EXPECT_EQ(table.clutter, 0);
  const Eigen::Vector3f top = test::kBall.cast<float>() + Eigen::Vector3f(0, 0, 0.1f);
  const SurfaceMeasures ball = measure_surface(points, top, 0.1f);
  EXPECT_GT(ball.points, 10);
  EXPECT_NEAR(ball.curvature_per_m * test::kBallRadius, 1, 0.2);
  EXPECT_GT(ball.clutter, 0.5f);
  EXPECT_EQ(measure_surface(points, {0, 0, 3}, 0.2f).points, 0);

  EXPECT_EQ(changed_share(*field, *field), 0);
  EXPECT_GT(changed_share(*field, *before), 0);
  EXPECT_EQ(changed_share(*field, DistanceField()), 1);
}

// 99 of 100 bricks stay; noise of 2 % in one of them is nothing, a fifth less light is.
TEST(Measures, WhatMovedIsNotWhatNoiseMakesDrift) {
  const auto grey = [](float radiance) {
    auto brick = std::make_shared<FieldBrick>();
    brick->radiance.fill(Eigen::Vector3f::Constant(radiance));
    brick->radiance_weight.fill(1);
    return brick;
  };
  DistanceField before, now;
  for (int i = 0; i < 100; ++i) before.bricks[{i, 0, 0}] = grey(0.5f);
  now = before;
  EXPECT_EQ(moved_share(now, before), 0);
  now.bricks[{0, 0, 0}] = grey(0.51f);
  EXPECT_EQ(moved_share(now, before), 0);
  EXPECT_GT(changed_share(now, before), 0);
  now.bricks[{0, 0, 0}] = grey(0.4f);
  EXPECT_NEAR(moved_share(now, before), 0.01, 1e-6);
  now.bricks[{0, 1, 0}] = grey(0.5f);
  EXPECT_NEAR(moved_share(now, before), 2.0 / 101, 1e-6);
}

TEST(Measures, WhatASolutionTells) {
  const auto albedo = [](float value, float sigma, std::size_t known) {
    auto brick = std::make_shared<AlbedoBrick>();
    brick->albedo.fill(Eigen::Vector3f::Constant(value));
    brick->sigma.fill(-1);
    std::fill_n(brick->sigma.begin(), known, sigma);
    AlbedoField field;
    field.bricks[{0, 0, 0}] = brick;
    return field;
  };
  const AlbedoNews news = compare_albedo(albedo(0.51f, 0.08f, 400), albedo(0.5f, 0.1f, 300));
  EXPECT_NEAR(news.change, 0.02, 1e-4);
  EXPECT_NEAR(news.newly_known, 0.25, 1e-6);
  EXPECT_NEAR(news.surer, 0.2, 1e-4);
}

}  // namespace
}  // namespace lumigraft
