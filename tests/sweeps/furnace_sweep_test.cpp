// Energy conservation: radiosity of a body under a uniform sky over its albedo.
#include <numbers>

#include "tests/relight/exhibit/model_shapes.h"
#include "tests/sweeps/sweep.h"

namespace lumigraft::test {
namespace {

class FurnaceSweep : public SweepTest {};
ON_VULKAN(FurnaceSweep);

constexpr float kShellRadius_m = 0.1f, kWall_m = 0.012f;

/// A hollow hemisphere, open at the top: inner surface, outer surface and rim.
relight::Model bowl() {
  constexpr int steps = 24;
  return model_of(revolved(2 * steps + 1, 2 * steps, [](float t) {
    const int n = static_cast<int>(std::lround(t * (2 * steps + 1)));
    const float r = n <= steps ? kShellRadius_m + kWall_m : kShellRadius_m;
    if (n == 0 || n == 2 * steps + 1) return Eigen::Vector2f(0, -r);
    if (n == steps || n == steps + 1) return Eigen::Vector2f(r, 0);
    const float polar =
        0.5f * std::numbers::pi_v<float> * static_cast<float>(n < steps ? n : 2 * steps + 1 - n) / steps;
    return Eigen::Vector2f(r * std::sin(polar), -r * std::cos(polar));
  }));
}

/// Mean radiance of the pixels fully covered by the object.
double mean_of_object(const relight::RelitPicture& picture) {
  double sum = 0;
  int count = 0;
  for (int v = 0; v < picture.srgb.height; ++v) {
    for (int u = 0; u < picture.srgb.width; ++u) {
      if (picture.maps->mask.at(u, v) < 1) continue;
      sum += picture_radiance(picture, u, v);
      ++count;
    }
  }
  EXPECT_GT(count, 100);
  return sum / std::max(count, 1);
}

// A ball of albedo ρ, far from everything in uniform light of radiance L, emits ρ L. Inside a ball with a fraction a of
// its surface cut away, each point sees the hole under the form factor a and the rest under 1 - a (the form factor
// between any two pieces of a sphere is their fraction of its area: Siegel & Howell 1992, § 7.4), so the radiosity is
// uniform: B = ρ (a L + (1 - a) B) = ρ a L / (1 - ρ (1 - a)), for a hemisphere ρ L / (2 - ρ). A floor as bright as the
// sky replaces the lower hemisphere. Steps or weights that do not sum to one show as a slope.
TEST_P(FurnaceSweep, BallAndBowlOverAlbedo) {
  constexpr float sky = 0.8f;
  Sweep sweep{.stem = "furnace-albedo",
              .title = "Even light: radiance compared with the closed form",
              .x_label = "albedo",
              .y_label = "radiance / closed form",
              .x = {0.1, 0.5, 1},
              .min = 0.9,
              .max = 1.1};
  ClosedScene scene;
  scene.width = 40;
  scene.height = 30;
  scene.sky = sky;
  scene.radiance = [](const Eigen::Vector3f&) { return sky; };
  for (const bool open : {false, true}) {
    scene.exhibit.objects = {sphere_object(kShellRadius_m, {0, 0, 0.6f}, 0)};
    scene.eye_m = {0, -0.3f, 0.75f};
    scene.look_at_m = {0, 0, 0.6f};
    if (open) {  // from above, so close that only the inside is visible
      scene.exhibit.objects[0].model = std::make_shared<const relight::Model>(bowl());
      scene.eye_m = {0, 0.01f, 0.9f};
      scene.focal_px = 125;
    }
    for (const Method& method : methods(open ? 64 : 32, open ? 4 : 1)) {
      if (method.plan.method == "dlpv") continue;  // light on objects is the same there
      Curve& curve = sweep.curves.emplace_back(Curve{method.name + (open ? ", in a bowl" : ", ball")});
      for (const double albedo : sweep.x) {
        scene.exhibit.objects[0].material.base_color->setConstant(static_cast<float>(albedo));
        const double want = open ? albedo * sky / (2 - albedo) : albedo * sky;
        curve.y.push_back(mean_of_object(relit(scene, method.plan)) / want);
      }
    }
  }
  expect_within_bounds(sweep);
}

}  // namespace
}  // namespace lumigraft::test
