// Transmissive objects, by the reference, against Fresnel, Snell, Beer and Lambert, and the focus of a ball.
#include <optional>

#include "tests/relight/reference/glass.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector3f;

/// A slab between the heights 0 and `thickness_m`, wide in all directions.
relight::ReferenceMesh slab(float thickness_m, const relight::Material& material) {
  return mesh_of(box({-20, -20, 0}, {20, 20, thickness_m}), material);
}

/// A wide panel below the slab that emits upwards, from the given x on.
relight::ReferenceLamp light_from_below(float from_x_m) {
  relight::ReferenceLamp lamp = panel({from_x_m + 20, 0, -0.5f}, 20, 20, 1);
  lamp.normal = Vector3f::UnitZ();
  lamp.half_v_m = -lamp.half_v_m;
  return lamp;
}

/// A narrow view of the point where a ray of this angle to the vertical enters the slab's top.
relight::PosedCamera at_angle(double angle, float height_m, float width_m) {
  const Vector3f to(0, 0, height_m);
  const Vector3f from = to + 2 * Vector3f(-std::sin(static_cast<float>(angle)), 0, std::cos(static_cast<float>(angle)));
  return looking(from, to, width_m, 8, 8);
}

double seen_through(const relight::ReferenceScene& scene, const relight::PosedCamera& camera, int samples = 256) {
  return mean(tracer_of(scene).radiance(camera, samples_of(samples), true));
}

TEST(ReferenceGlass, ALosslessBallInAFurnaceIsInvisible) {
  for (const float roughness : {0.0f, 0.2f}) {
    relight::ReferenceScene scene;
    scene.background = {1, 0.5f, 0.25f};
    scene.objects = {smooth_ball(0.1f, {0, 0, 0}, glass(1.5f, roughness))};
    const relight::PosedCamera camera = looking({0, -1, 0.2f}, {0, 0, 0}, 0.12f, 16, 16);
    const auto picture = tracer_of(scene).radiance(camera, samples_of(64), true);
    EXPECT_NEAR(mean(picture, 0), 1, roughness > 0 ? 0.02 : 0.01) << roughness;
    EXPECT_NEAR(mean(picture, 2), 0.25, 0.005) << roughness;
  }
}

TEST(ReferenceGlass, ASlabTransmitsAsFresnel) {
  relight::ReferenceScene scene;
  scene.lamps = {light_from_below(-20)};
  scene.objects = {slab(0.1f, glass())};
  for (const double angle : {0.0, 0.6, 1.2}) {
    const double r = fresnel_reflectance(angle, 1.5);
    // The sum over internal reflections.
    EXPECT_NEAR(seen_through(scene, at_angle(angle, 0.1f, 0.01f)), (1 - r) / (1 + r), 0.01) << angle;
  }
}

// A ray leaves the slab where Snell's angle leads, so the edge of the panel is seen displaced.
TEST(ReferenceGlass, ASlabDisplacesAsSnell) {
  constexpr double kAngle = 0.8, kThickness_m = 0.1;
  const double inside = std::asin(std::sin(kAngle) / 1.5);
  const double x_m = kThickness_m * std::tan(inside) + 0.5 * std::tan(kAngle);
  relight::ReferenceScene scene;
  scene.objects = {slab(kThickness_m, glass())};
  scene.lamps = {light_from_below(-20)};
  // The lobe of smooth materials spreads the edge over a few millimetres.
  const relight::PosedCamera camera = at_angle(kAngle, kThickness_m, 0.001f);
  const double all = seen_through(scene, camera);
  for (const double off_m : {-0.01, 0.01}) {
    scene.lamps = {light_from_below(static_cast<float>(x_m + off_m))};
    EXPECT_NEAR(seen_through(scene, camera) / all, off_m < 0 ? 1 : 0, 0.12) << off_m;
  }
}

TEST(ReferenceGlass, AbsorbsAsBeerAndLambert) {
  relight::Material material = glass();
  material.attenuation_color = {0.5f, 0.25f, 0.9f};
  material.attenuation_distance_m = 0.2f;
  for (const bool is_override : {false, true}) {
    relight::ReferenceScene scene;
    scene.lamps = {light_from_below(-20)};
    scene.objects = {slab(0.1f, material)};
    // Twice as large: its own distance is the model's, that of an override is not.
    scene.objects[0].T_tag_model.linear() *= 2;
    if (is_override) scene.objects[0].material.attenuation_distance_m = 0.2f;
    const double path_m = 0.2 / std::cos(std::asin(std::sin(0.6) / 1.5)), r = fresnel_reflectance(0.6, 1.5);
    const auto picture = tracer_of(scene).radiance(at_angle(0.6, 0.2f, 0.01f), samples_of(256), true);
    for (int c = 0; c < 3; ++c) {
      const double passed =
          std::pow(static_cast<double>(material.attenuation_color[c]), path_m / (is_override ? 0.2 : 0.4));
      const double expected = (1 - r) * (1 - r) * passed / (1 - r * r * passed * passed);
      EXPECT_NEAR(mean(picture, c), expected, 0.01) << is_override << c;
    }
  }
}

TEST(ReferenceGlass, ASheetColoursOnce) {
  relight::Material material = glass();
  material.thin_walled = true;
  material.base_color = {0.8f, 0.4f, 0.1f};
  relight::ReferenceScene scene;
  scene.lamps = {light_from_below(-20)};
  scene.objects = {square(5, 0, material)};
  const auto picture = tracer_of(scene).radiance(at_angle(0.5, 0, 0.01f), samples_of(256), true);
  for (int c = 0; c < 3; ++c) {
    const double expected = static_cast<double>(material.base_color[c]) * (1 - fresnel_reflectance(0.5, 1.5));
    EXPECT_NEAR(mean(picture, c), expected, 0.01) << c;
  }
}

constexpr float kBall_m = 0.1f, kBallHeight_m = 0.5f, kFloor = 0.05f, kLampHeight_m = 50, kLampRadius_m = 0.1f;

relight::ReferenceScene ball_over_floor(const relight::Material& material) {
  relight::ReferenceScene scene;
  scene.real = {square(5, 0, lambert(kFloor))};
  scene.objects = {smooth_ball(kBall_m, {0, 0, kBallHeight_m}, material)};
  scene.lamps = {bulb({0, 0, kLampHeight_m}, kLampRadius_m, 1e6f)};
  return scene;
}

/// Of the distant lamp at the floor.
constexpr double kLampIrradiance =
    1e6 * std::numbers::pi * kLampRadius_m * kLampRadius_m / (kLampHeight_m * kLampHeight_m);

/// Where light of a beam along the axis of the ball, at this distance from it, meets the floor, from the axis, after so
/// many paths through the ball (0: reflected outside); none if it goes up.
std::optional<double> meets_floor(double h_m, int paths) {
  const double i = std::asin(h_m / kBall_m), inside = std::asin(h_m / kBall_m / 1.5);
  // Angles from the vertical through the centre: of the point where it leaves, and of its direction.
  const double at = i + paths * (std::numbers::pi - 2 * inside), along = at + i;
  if (std::cos(along) >= -1e-6) return std::nullopt;
  const double down_m = static_cast<double>(kBallHeight_m) + kBall_m * std::cos(at);
  return kBall_m * std::sin(at) - std::tan(along) * down_m;
}

/// Change of the power that falls on the floor within a radius around the point below the ball, W.
double change_of_power(const relight::ReferencePicture& picture, const relight::PosedCamera& camera, double within_m) {
  double sum = 0;
  const auto on_floor = [&](double u, double v) -> Eigen::Vector3d {
    const Eigen::Vector3d w = camera.T_tag_camera.linear().cast<double>() * *camera.model.unproject({u, v});
    const Eigen::Vector3d from = camera.T_tag_camera.translation().cast<double>();
    return from - from.z() / w.z() * w;
  };
  for (int v = 0; v < camera.model.height; ++v) {
    for (int u = 0; u < camera.model.width; ++u) {
      const Eigen::Vector3d p = on_floor(u, v);
      if (p.head<2>().norm() > within_m) continue;
      const Eigen::Vector3d along = on_floor(u + 0.5, v) - on_floor(u - 0.5, v),
                            down = on_floor(u, v + 0.5) - on_floor(u, v - 0.5);
      sum += static_cast<double>(picture.change.at(u, v)) * std::numbers::pi / static_cast<double>(kFloor) *
             along.cross(down).norm();
    }
  }
  return sum;
}

/// Power that the ball sends to the floor within a radius, over that of a beam with the ball's section.
double lands_within(double within_m) {
  constexpr int kSteps = 4000, kMaxPaths = 8;
  double sum = 0;
  for (int k = 0; k < kSteps; ++k) {
    const double h_m = kBall_m * (k + 0.5) / kSteps, r = fresnel_reflectance(std::asin(h_m / kBall_m), 1.5);
    for (int paths = 0; paths < kMaxPaths; ++paths) {
      const auto x_m = meets_floor(h_m, paths);
      const double share = paths == 0 ? r : (1 - r) * (1 - r) * std::pow(r, paths - 1);
      if (x_m && std::abs(*x_m) < within_m) sum += share * 2 * (k + 0.5) / kSteps / kSteps;
    }
  }
  return sum;
}

TEST(ReferenceGlass, ABallFocusesWithTheRightEnergy) {
  const relight::ReferenceScene scene = ball_over_floor(glass());
  const relight::PosedCamera camera = looking({0, -2, 0.8f}, {0, 0, 0}, 1.6f, 96, 96);
  const relight::ReferencePicture picture = tracer_of(scene).change(camera, samples_of(8));
  const double beam_W = kLampIrradiance * std::numbers::pi * static_cast<double>(kBall_m * kBall_m);
  for (const double within_m : {0.2, 0.35, 0.5}) {
    const double expected = lands_within(within_m) - 1;
    EXPECT_NEAR(change_of_power(picture, camera, within_m) / beam_W, expected, 0.03) << within_m;
  }
}

// Photons against paths, which find a large lamp through the ball themselves.
TEST(ReferenceGlass, PhotonsBringWhatPathsFind) {
  relight::Material tinted = glass(1.5f, 0.3f);
  tinted.attenuation_color = {0.9f, 0.5f, 0.2f};
  tinted.attenuation_distance_m = 0.2f;
  relight::Material mixed = glass(1.3f, 0.2f);
  mixed.base_color = {0.4f, 0.8f, 0.8f};
  mixed.transmission = 0.6f;
  relight::ReferenceScene scene;
  scene.real = {square(5, 0, lambert(0.5f))};
  scene.objects = {smooth_ball(0.2f, {0, 0, 0.25f}, tinted, 48), smooth_ball(0.1f, {0.25f, 0.15f, 0.1f}, mixed, 48)};
  scene.lamps = {panel({0.2f, 0, 1.5f}, 0.3f, 0.3f, 10)};
  const relight::PosedCamera camera = looking({0, -2, 1.5f}, {0, 0, 0}, 0.8f, 24, 24);
  const relight::DeltaPathTracer tracer = tracer_of(scene);
  const relight::ReferencePicture photons = tracer.change(camera, samples_of(256));
  const auto with = tracer.radiance(camera, samples_of(1024), true),
             without = tracer.radiance(camera, samples_of(1024), false);
  for (int c = 0; c < 3; ++c) {
    double found = 0, expected = 0, all = 0;
    for (int v = 0; v < 24; ++v) {
      for (int u = 0; u < 24; ++u) {
        if (photons.coverage.at(u, v) > 0) continue;
        found += static_cast<double>(photons.change.at(u, v, c));
        expected += static_cast<double>(with.at(u, v, c) - without.at(u, v, c));
        all += std::abs(static_cast<double>(with.at(u, v, c) - without.at(u, v, c)));
      }
    }
    EXPECT_NEAR(found, expected, 0.03 * all) << c;
  }
}

}  // namespace
}  // namespace lumigraft::test
