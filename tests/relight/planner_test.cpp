#include "relight/planner.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "reconstruct/light/environment.h"
#include "relight/parameters.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

/// Lamps all around, 5 m away, under a sky; irradiances at the probe.
reconstruct::Scene build_trace_scene(const std::vector<float>& irradiances,
                                     const std::function<float(const Vector3f&)>& sky) {
  auto light = std::make_shared<reconstruct::Illumination>();
  light->environment.radiance = capture::Image<float>(128, 64, 3);
  for (int v = 0; v < 64; ++v)
    for (int u = 0; u < 128; ++u)
      for (int c = 0; c < 3; ++c)
        light->environment.radiance.at(u, v, c) = sky(reconstruct::environment_direction(u, v, 128, 64));
  light->environment_sh = reconstruct::project_sh(light->environment);
  for (std::size_t i = 0; i < irradiances.size(); ++i) {
    reconstruct::PointLight lamp;
    lamp.id = static_cast<int>(i);
    lamp.direction = Vector3f(std::cos(0.7f * static_cast<float>(i)), std::sin(0.7f * static_cast<float>(i)), 1);
    lamp.direction.normalize();
    lamp.irradiance.setConstant(irradiances[i]);
    lamp.distance_known = true;
    lamp.position_m = 5 * lamp.direction;
    lamp.radius_m = 0.05f;
    lamp.intensity = 25 * lamp.irradiance;
    light->lights.push_back(lamp);
  }
  reconstruct::Scene scene;
  scene.illumination = light;
  return scene;
}

float dark(const Vector3f&) { return 0; }

Exhibit ball_at(const Eigen::Vector3d& place_m) {
  auto model = std::make_shared<Model>();
  model->positions_m = {{-0.1f, -0.1f, -0.1f}, {0.1f, 0.1f, 0.1f}};
  Exhibit exhibit;
  exhibit.objects.push_back({});
  exhibit.objects[0].model = model;
  exhibit.objects[0].position_m = place_m;
  return exhibit;
}

const PlanChoice& choice(const Planner::Decision& decision, const std::string& key) {
  for (const PlanChoice& one : decision.choices)
    if (one.key == key) return one;
  static const PlanChoice none;
  ADD_FAILURE() << "nothing was decided of " << key;
  return none;
}

// 8 lamps, of which 2 carry 99.2 %.
const std::vector<float> kTwoOfEight = {20, 11, 0.05f, 0.04f, 0.04f, 0.04f, 0.04f, 0.04f};

TEST(Planner, TwoLampsOfEightCarryAlmostAll) {
  const Planner::Decision decision = Planner({}).decide(build_trace_scene(kTwoOfEight, dark), {}, 0);
  EXPECT_EQ(decision.plan.max_lights, 2);
  EXPECT_NEAR(choice(decision, "max_lights").left_out, 0.25f / 31.25f, 1e-4);
  EXPECT_EQ(choice(decision, "max_lights").requested, Plan().max_lights);
}

TEST(Planner, MethodsWithoutADeviceTakeAllThereIs) {
  for (const char* method : {"rays", "reference"}) {
    Plan plan;
    plan.method = method;
    const Planner::Decision decision = Planner(plan).decide(build_trace_scene(kTwoOfEight, dark), {}, 0);
    EXPECT_TRUE(decision.choices.empty()) << method;
    EXPECT_EQ(decision.plan.max_lights, Plan().max_lights) << method;
  }
}

// The order in which lamps come, which the drawing does not follow either.
TEST(Planner, TheStrongestAreCounted) {
  const Planner::Decision decision = Planner({}).decide(build_trace_scene({0.04f, 11, 0.05f, 20}, dark), {}, 0);
  EXPECT_EQ(decision.plan.max_lights, 2);
}

TEST(Planner, LampsThatAllMatterAreAllDrawnAsFarAsAsked) {
  EXPECT_EQ(Planner({}).decide(build_trace_scene({1, 1, 1, 1, 1, 1, 1, 1}, dark), {}, 0).plan.max_lights, 8);
  const Planner::Decision decision = Planner({}).decide(build_trace_scene(std::vector<float>(64, 1.0f), dark), {}, 0);
  EXPECT_EQ(decision.plan.max_lights, 32);
  EXPECT_NEAR(choice(decision, "max_lights").left_out, 0.5, 1e-3) << "more than the bound is said";
}

// Irradiance 0.05 at the probe, 5 m away; 0.5 m from the object a hundred times as much.
TEST(Planner, ALampThatIsWeakAtTheProbeButNearAnObjectStays) {
  const reconstruct::Scene scene = build_trace_scene(kTwoOfEight, dark);
  const Vector3f lamp = scene.illumination->lights[2].position_m;
  const Exhibit near = ball_at((0.9f * lamp).cast<double>());
  EXPECT_EQ(Planner({}).decide(scene, near, 0).plan.max_lights, 3);
  EXPECT_EQ(Planner({}).decide(scene, ball_at({0, 0, 0}), 0).plan.max_lights, 2);
}

TEST(Planner, AConstantSkyNeedsOneBand) {
  const Planner::Decision decision =
      Planner({}).decide(build_trace_scene({}, [](const Vector3f&) { return 0.3f; }), {}, 0);
  EXPECT_EQ(decision.plan.sh_bands, 1);
  EXPECT_EQ(decision.plan.max_lights, 0);
}

// L = 1 + z: E = pi + 2 pi / 3 n.z, of which the root mean square of the slope is 2 / (3 sqrt 3) of the mean.
TEST(Planner, ASlopeNeedsTwoBands) {
  const reconstruct::Scene scene = build_trace_scene({}, [](const Vector3f& w) { return 1 + w.z(); });
  EXPECT_EQ(Planner({}).decide(scene, {}, 0).plan.sh_bands, 2);
  EXPECT_NEAR(measure_light(*scene.illumination).bands_left_out[0], 2 / (3 * std::sqrt(3.0)), 2e-3);
  EXPECT_NEAR(measure_light(*scene.illumination).bands_left_out[1], 0, 2e-3);
}

// The same sky and a lamp with a hundred times its light: 0.4 % of all.
TEST(Planner, TheBoundIsOfAllLight) {
  const float sky = 4 * std::numbers::pi_v<float>;
  const reconstruct::Scene scene = build_trace_scene({100 * sky}, [](const Vector3f& w) { return 1 + w.z(); });
  EXPECT_EQ(Planner({}).decide(scene, {}, 0).plan.sh_bands, 1);
}

TEST(Planner, WhatIsSetByHandStays) {
  Plan asked;
  asked.max_lights = 5;
  asked.user_set = {"max_lights"};
  const reconstruct::Scene scene = build_trace_scene(kTwoOfEight, [](const Vector3f&) { return 0.3f; });
  const Plan plan = Planner(asked).decide(scene, {}, 0).plan;
  EXPECT_EQ(plan.max_lights, 5);
  EXPECT_EQ(plan.sh_bands, 1) << "the rest follows";
  asked.adaptive = 0;
  const Planner::Decision decision = Planner(asked).decide(scene, {}, 0);
  EXPECT_EQ(decision.plan.sh_bands, 3);
  EXPECT_TRUE(decision.choices.empty());
}

TEST(Planner, WithoutLightThePlanIsAsAsked) {
  const Planner::Decision decision = Planner({}).decide({}, {}, 0);
  EXPECT_EQ(decision.plan.max_lights, Plan().max_lights);
  EXPECT_TRUE(decision.choices.empty());
}

// A lamp whose share trembles around the bound, as with noise: 0.9 to 1.1 %.
TEST(Planner, AFractionThatVariesAroundTheBoundChangesThePlanOnce) {
  Planner planner({});
  int changes = 0, before = planner.decide(build_trace_scene({20, 10, 0.27f}, dark), {}, 0).plan.max_lights;
  EXPECT_EQ(before, 2);
  for (int i = 0; i < 300; ++i) {
    const float trembling = i % 2 == 0 ? 0.33f : 0.27f;
    const int now = planner.decide(build_trace_scene({20, 10, trembling}, dark), {}, 0).plan.max_lights;
    changes += now != before;
    before = now;
  }
  EXPECT_EQ(changes, 1);
  EXPECT_EQ(before, 3);
}

TEST(Planner, MoreIsTakenAtOnceAndLessAfterAWhile) {
  Planner planner({});
  const reconstruct::Scene bright = build_trace_scene({20, 10, 5}, dark),
                           dim = build_trace_scene({20, 10, 0.01f}, dark);
  EXPECT_EQ(planner.decide(dim, {}, 0).plan.max_lights, 2);
  EXPECT_EQ(planner.decide(bright, {}, 0).plan.max_lights, 3);
  for (int i = 1; i < kRelight.calm_frames; ++i) EXPECT_EQ(planner.decide(dim, {}, 0).plan.max_lights, 3) << i;
  EXPECT_EQ(planner.decide(dim, {}, 0).plan.max_lights, 2);
}

TEST(Planner, TexelsAreHalfVoxelsWhereLightIsTracedForPixels) {
  const reconstruct::Scene scene = build_trace_scene({1}, dark);
  EXPECT_EQ(Planner({}).decide(scene, {}, 0).plan.rsm, 128);
  Plan live;
  live.trace_scale = 4;
  EXPECT_EQ(Planner(live).decide(scene, {}, 0).plan.rsm, live.rsm) << "lamps' shadows are as fine as that";
}

}  // namespace
}  // namespace lumigraft::relight
