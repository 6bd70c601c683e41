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

// If shadows were sharper at the tabulated distances they would fit best there and attract the search.
TEST(ShadingModel, ShadowsMoveSmoothlyWithDistance) {
  TestRoom room;
  room.boxes = {{{0.0f, 0.0f, 0.0f}, {0.1f, 0.1f, 0.25f}}};
  room.lamps = {{{0.9f, -0.7f, 0.8f}, {1, 1, 1}, 0.02f}};
  const DistanceField field = room.field();
  const FieldRays rays(field);
  const MetalMask metal{capture::Session()};
  const Illumination light = room.illumination();
  const IrradianceModel room_light(field, rays, metal, light);
  std::vector<SurfaceSample> samples;
  for (float x = -0.5f; x < 0.2f; x += 0.01f) {
    for (float y = -0.1f; y < 0.5f; y += 0.01f)
      samples.push_back({Vector3f(x, y, 0), Vector3f::UnitZ(), Vector3f::Ones(), 0.01f});
  }
  const std::vector<Vector3f> gathered(samples.size(), Vector3f::Zero());
  ShadingModel model(room_light, light, samples, gathered);
  const std::vector<double> knots{0.6, 0.67, 0.74, 0.81, 0.88, 0.95, 1.02};
  model.tabulate(0, knots, kLampParameters.search.fine_rays);

  const auto at = [&](double inverse_distance) {
    std::vector<float> factors;
    model.factors(0, {.inverse_distance = inverse_distance}, factors);
    return factors;
  };
  constexpr double kStep = 0.01;
  int moving = 0;
  for (std::size_t k = 2; k + 2 < knots.size(); ++k) {
    const std::vector<float> before = at(knots[k] - kStep), here = at(knots[k]), after = at(knots[k] + kStep);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (std::abs(after[i] - before[i]) < 0.02f) continue;
      ++moving;
      EXPECT_LT(std::abs(after[i] - 2 * here[i] + before[i]), 0.5f * std::abs(after[i] - before[i]) + 0.03f);
    }
  }
  EXPECT_GT(moving, 50) << "shadows move";
}

// Rays at a few distances decide where visibility is constant; elsewhere all distances are traced.
TEST(ShadingModel, VisibilityBetweenTracedDistances) {
  TestRoom room;
  room.boxes = {{{0.0f, 0.0f, 0.0f}, {0.1f, 0.1f, 0.25f}}};
  room.lamps = {{{0.9f, -0.7f, 0.8f}, {1, 1, 1}, 0.02f}};
  const DistanceField field = room.field();
  const FieldRays rays(field);
  const MetalMask metal{capture::Session()};
  const Illumination light = room.illumination();
  const IrradianceModel room_light(field, rays, metal, light);
  std::vector<SurfaceSample> samples;
  for (float x = -0.5f; x < 0.2f; x += 0.02f) {
    for (float y = -0.1f; y < 0.5f; y += 0.02f)
      samples.push_back({Vector3f(x, y, 0), Vector3f::UnitZ(), Vector3f::Ones(), 0.02f});
  }
  const std::vector<Vector3f> gathered(samples.size(), Vector3f::Zero());
  ShadingModel model(room_light, light, samples, gathered);
  std::vector<double> knots;
  for (int k = 0; k < 11; ++k) knots.push_back(0.6 + 0.044 * k);
  model.tabulate(0, knots, kLampParameters.search.fine_rays);

  int different = 0, penumbra = 0;
  for (std::size_t k = 1; k + 1 < knots.size(); ++k) {
    std::vector<float> factors;
    model.factors(0, {.inverse_distance = knots[k]}, factors);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const auto visible = [&](std::size_t at) {
        return room_light.visibility(light.lights[0], static_cast<float>(1 / knots[at]), samples[i].position,
                                     samples[i].normal, kLampParameters.search.fine_rays);
      };
      const float blended = (visible(k - 1) + 4 * visible(k) + visible(k + 1)) / 6;  // cubic B-spline
      const Vector3f offset =
          light.lights[0].direction + static_cast<float>(knots[k]) * (light.probe_position_m - samples[i].position);
      different += std::abs(factors[i] - blended * offset.z() / std::pow(offset.norm(), 3.0f)) > 0.01f;
      penumbra += blended > 0.01f && blended < 0.99f;
    }
  }
  const int all = static_cast<int>(samples.size() * (knots.size() - 2));
  EXPECT_GT(penumbra, all / 50) << "shadows are in the picture";
  EXPECT_LT(different, all / 200);
}

}  // namespace
}  // namespace lumigraft::reconstruct
