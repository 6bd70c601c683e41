// A shadow longer than the volumes' range.
#include <numbers>

#include "tests/sweeps/sweep.h"

namespace lumigraft::test {
namespace {

class LongShadowSweep : public SweepTest {};
ON_VULKAN(LongShadowSweep);

constexpr float kElevation = 10 * std::numbers::pi_v<float> / 180;
constexpr float kPillarHalf_m = 0.03f, kPillarHeight_m = 0.12f;

reconstruct::PointLight sun() {
  reconstruct::PointLight light;
  light.direction = {std::cos(kElevation), 0, std::sin(kElevation)};
  light.irradiance.setConstant(3);
  light.angular_radius_rad = 0.0047f;
  return light;
}

/// A column on a reconstructed floor in sunlight; the camera looks at its shadow, `ahead_m` from the column.
ClosedScene column(float ahead_m) {
  ClosedScene scene;
  scene.extent = {Eigen::Vector3f(-1.2f, -0.6f, -0.1f), Eigen::Vector3f(0.6f, 0.6f, 0.1f)};
  scene.focal_px = 130;
  scene.eye_m = {-ahead_m, -0.25f, 0.85f};
  scene.look_at_m = {-ahead_m, 0, 0};
  scene.lamps = {sun()};
  scene.exhibit.objects = {
      box_object({-kPillarHalf_m, -kPillarHalf_m, 0}, {kPillarHalf_m, kPillarHalf_m, kPillarHeight_m}, 0)};
  return scene;
}

// A column with the sun at 10° elevation: its shadow is 0.68 m long and leaves the volumes, which end 0.3 m from the
// column's centre. Along its axis all sunlight is removed to its end: beyond the part of the field in memory (in live
// settings the volumes), albedo is computed from the camera's picture and the light.
TEST_P(LongShadowSweep, AColumnInASunOfTenDegrees) {
  Sweep sweep{.stem = "long-shadow",
              .title = "Shadow of a column 12 cm high in a sun of 10°",
              .x_label = "distance from the column, m",
              .y_label = "fraction of the sun's light that is taken",
              .x = {},
              .min = 0.94,
              .max = 1.03};
  const int bins = 16;
  for (int i = 0; i < bins; ++i) sweep.x.push_back(0.04 + 0.04 * i);
  ClosedScene scene = column(0.3f);
  scene.width = 120;
  scene.height = 40;
  scene.sky = 0;
  const float lit = 0.5f / std::numbers::pi_v<float> * 3 * std::sin(kElevation);
  scene.radiance = [lit](const Eigen::Vector3f&) { return lit; };
  for (const Method& method : methods(64, 1)) {
    std::vector<double> sums(bins, 0.0);
    std::vector<int> counts(bins, 0);
    const relight::RelitPicture picture = served(scene, method.plan);
    for_each_floor_pixel(scene, picture, [&](const Eigen::Vector3f& p, const Eigen::Vector3f& delta, float) {
      const int i = static_cast<int>(std::lround((-p.x() - kPillarHalf_m) / 0.04f)) - 1;
      if (std::abs(p.y()) > 0.5f * kPillarHalf_m || i < 0 || i >= bins) return;
      sums[static_cast<std::size_t>(i)] -= delta.x() / lit;
      ++counts[static_cast<std::size_t>(i)];
    });
    Curve& curve = sweep.curves.emplace_back(Curve{method.name});
    for (std::size_t i = 0; i < sums.size(); ++i) {
      EXPECT_GT(counts[i], 5) << i;
      curve.y.push_back(sums[i] / counts[i]);
    }
  }
  write_sweep(sweep);
  for (const Curve& curve : sweep.curves) {
    for (std::size_t i = 0; i < sweep.x.size() && sweep.x[i] < 0.65; ++i) {
      EXPECT_GE(curve.y[i], sweep.min) << curve.name << ", " << sweep.x[i] << " m";
      EXPECT_LE(curve.y[i], sweep.max) << curve.name << ", " << sweep.x[i] << " m";
    }
  }
}

// With a sky as well: beyond the bricks the floor's albedo is π b / E, with b the camera's radiance and E the
// irradiance of sky and sun, π L + E_sun sin 10°. The column removes the sun's part, and no visible part of the sky's
// at half a metre.
TEST_P(LongShadowSweep, LightTellsTheAlbedoBeyondTheField) {
  constexpr float albedo = 0.3f, sky = 0.2f;
  ClosedScene scene = column(0.6f);
  scene.width = 60;
  scene.height = 20;
  scene.albedo = albedo;
  scene.sky = sky;
  const float lost = albedo / std::numbers::pi_v<float> * 3 * std::sin(kElevation);
  scene.radiance = [lost](const Eigen::Vector3f&) { return albedo * sky + lost; };
  double sum = 0;
  int count = 0;
  for_each_floor_pixel(scene, relit(scene, careful_plan(64, 1)),
                       [&](const Eigen::Vector3f& p, const Eigen::Vector3f& delta, float) {
                         if (p.x() < -0.67f || p.x() > -0.57f || std::abs(p.y()) > 0.5f * kPillarHalf_m) return;
                         sum -= delta.x();
                         ++count;
                       });
  EXPECT_GT(count, 10);
  EXPECT_NEAR(sum / count, lost, 0.03 * lost);
}

}  // namespace
}  // namespace lumigraft::test
