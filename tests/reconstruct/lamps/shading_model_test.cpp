// The shading model between the distances at which visibility is tabulated.
#include "reconstruct/lamps/shading_model.h"

#include <gtest/gtest.h>

#include <cmath>

#include "reconstruct/field/field_rays.h"
#include "reconstruct/field/real_surface_mesh.h"
#include "reconstruct/lamps/parameters.h"
#include "reconstruct/shading/irradiance.h"
#include "tests/reconstruct/albedo/albedo_room.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

/// A box on a floor, under a lamp, with samples of the floor around the box's shadow.
struct ShadowOfABox {
  TestRoom room;
  DistanceField field;
  FieldRays rays;
  MetalMask metal{capture::Session()};
  Illumination light;
  IrradianceModel room_light;
  std::vector<SurfaceSample> samples;
  std::vector<Vector3f> gathered;
  ShadingModel model;

  explicit ShadowOfABox(float sample_m, float lamp_radius_m = 0.02f)
      : room(box_under_lamp(lamp_radius_m)),
        field(room.field()),
        rays(field),
        light(room.illumination()),
        room_light(field, rays, metal, light),
        samples(floor_samples(sample_m)),
        gathered(samples.size(), Vector3f::Zero()),
        model(room_light, light, samples, gathered) {}

 private:
  static TestRoom box_under_lamp(float lamp_radius_m) {
    TestRoom room;
    room.boxes = {{{0.0f, 0.0f, 0.0f}, {0.1f, 0.1f, 0.25f}}};
    room.lamps = {{{0.9f, -0.7f, 0.8f}, {1, 1, 1}, lamp_radius_m}};
    return room;
  }
  static std::vector<SurfaceSample> floor_samples(float step_m) {
    std::vector<SurfaceSample> samples;
    for (float x = -0.5f; x < 0.2f; x += step_m) {
      for (float y = -0.1f; y < 0.5f; y += step_m)
        samples.push_back({Vector3f(x, y, 0), Vector3f::UnitZ(), Vector3f::Ones(), step_m});
    }
    return samples;
  }
};

// If shadows were sharper at the tabulated distances they would fit best there and attract the search.
TEST(ShadingModel, ShadowsMoveSmoothlyWithDistance) {
  ShadowOfABox scene(0.01f);
  const std::vector<double> knots{0.6, 0.67, 0.74, 0.81, 0.88, 0.95, 1.02};
  scene.model.tabulate(0, knots, kLampParameters.search.fine_rays);

  const auto at = [&](double inverse_distance) {
    std::vector<float> factors;
    scene.model.factors(0, {.inverse_distance = inverse_distance}, factors);
    return factors;
  };
  constexpr double kStep = 0.01;
  int moving = 0;
  for (std::size_t k = 2; k + 2 < knots.size(); ++k) {
    const std::vector<float> before = at(knots[k] - kStep), here = at(knots[k]), after = at(knots[k] + kStep);
    for (std::size_t i = 0; i < scene.samples.size(); ++i) {
      if (std::abs(after[i] - before[i]) < 0.02f) continue;
      ++moving;
      EXPECT_LT(std::abs(after[i] - 2 * here[i] + before[i]), 0.5f * std::abs(after[i] - before[i]) + 0.03f);
    }
  }
  EXPECT_GT(moving, 50) << "shadows move";
}

// Rays at a few distances decide where visibility is constant; elsewhere all distances are traced.
TEST(ShadingModel, VisibilityBetweenTracedDistances) {
  ShadowOfABox scene(0.02f);
  std::vector<double> knots;
  for (int k = 0; k < 11; ++k) knots.push_back(0.6 + 0.044 * k);
  scene.model.tabulate(0, knots, kLampParameters.search.fine_rays);

  int different = 0, penumbra = 0;
  for (std::size_t k = 1; k + 1 < knots.size(); ++k) {
    std::vector<float> factors;
    scene.model.factors(0, {.inverse_distance = knots[k]}, factors);
    for (std::size_t i = 0; i < scene.samples.size(); ++i) {
      const auto visible = [&](std::size_t at) {
        return scene.room_light.visibility(scene.light.lights[0], static_cast<float>(1 / knots[at]),
                                           scene.samples[i].position, scene.samples[i].normal,
                                           kLampParameters.search.fine_rays);
      };
      const float blended = (visible(k - 1) + 4 * visible(k) + visible(k + 1)) / 6;  // cubic B-spline
      const Vector3f offset = scene.light.lights[0].direction +
                              static_cast<float>(knots[k]) * (scene.light.probe_position_m - scene.samples[i].position);
      different += std::abs(factors[i] - blended * offset.z() / std::pow(offset.norm(), 3.0f)) > 0.01f;
      penumbra += blended > 0.01f && blended < 0.99f;
    }
  }
  const int all = static_cast<int>(scene.samples.size() * (knots.size() - 2));
  EXPECT_GT(penumbra, all / 50) << "shadows are in the picture";
  EXPECT_LT(different, all / 200);
}

// Few samples are in a penumbra that is many samples wide; all of it is traced.
TEST(ShadingModel, PenumbraOfAWideLamp) {
  ShadowOfABox scene(0.02f, 0.15f);
  const double inverse = 1 / (scene.room.lamps[0].position - scene.light.probe_position_m).norm();
  constexpr int kRays = 16;
  scene.model.tabulate(0, {inverse}, kRays);
  std::vector<float> factors;
  scene.model.factors(0, {.inverse_distance = inverse}, factors);
  int different = 0, penumbra = 0;
  for (std::size_t i = 0; i < scene.samples.size(); ++i) {
    const float visible = scene.room_light.visibility(scene.light.lights[0], static_cast<float>(1 / inverse),
                                                      scene.samples[i].position, scene.samples[i].normal, kRays);
    const Vector3f offset = scene.light.lights[0].direction +
                            static_cast<float>(inverse) * (scene.light.probe_position_m - scene.samples[i].position);
    different += std::abs(factors[i] - visible * offset.z() / std::pow(offset.norm(), 3.0f)) > 0.01f;
    penumbra += visible > 0 && visible < 1;
  }
  EXPECT_GT(penumbra, static_cast<int>(scene.samples.size()) / 10);
  EXPECT_LT(different, penumbra / 50);
}

// The light of a near panel falls off less than that of a point.
TEST(ShadingModel, LightOfAWidePanel) {
  constexpr float kRadius_m = 0.25f;
  TestRoom room;
  room.probe = {0, 0, 0};
  room.lamps = {{.position = {0.2f, 0.1f, 0.7f}, .intensity = {1, 1, 1}, .radius = kRadius_m, .flat = true}};
  const TestLamp& lamp = room.lamps[0];
  const Vector3f way = lamp.position - room.probe;
  const Illumination light = room.illumination();

  const DistanceField field = room.field();
  const FieldRays rays(field);
  const MetalMask metal{capture::Session()};
  const IrradianceModel room_light(field, rays, metal, light);
  std::vector<SurfaceSample> samples;
  for (float x = -0.5f; x < 0.55f; x += 0.1f)
    samples.push_back({Vector3f(x, 0, 0), Vector3f::UnitZ(), Vector3f::Ones()});
  const std::vector<Vector3f> gathered(samples.size(), Vector3f::Zero());
  ShadingModel model(room_light, light, samples, gathered);
  LampShape shape{.inverse_distance = 1 / static_cast<double>(way.norm()), .flat = true};
  shape.tilt = model.tilt_of(0, lamp.normal);
  model.tabulate(0, {shape.inverse_distance}, 1);
  std::vector<float> factors;
  model.factors(0, shape, factors);
  for (std::size_t i = 0; i < samples.size(); ++i)
    EXPECT_NEAR(
        factors[i] * light.lights[0].irradiance.x() / lamp.irradiance(samples[i].position, samples[i].normal).x(), 1,
        0.03)
        << samples[i].position.transpose();
}

}  // namespace
}  // namespace lumigraft::reconstruct
