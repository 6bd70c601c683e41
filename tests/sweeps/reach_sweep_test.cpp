// Change by an object at the outer limits of the volumes.
#include <algorithm>

#include "capture/camera/srgb.h"
#include "tests/sweeps/sweep.h"

namespace lumigraft::test {
namespace {

class ReachSweep : public SweepTest {};
ON_VULKAN(ReachSweep);

// A black ball over a floor under a uniform sky L occludes its form factor, cos θ (r/d)² (Nusselt 1928), at every
// distance: beyond the inner volume's edge (1.3 r from the centre), the outer one's (4.55 r) and the limit of the
// per-pixel lookup. An operator cut off there would drop the rest of the change at once.
TEST_P(ReachSweep, ABallsShadowOfTheSkyOverDistance) {
  constexpr float radius_m = 0.1f, height_m = 0.12f;
  const float level = capture::srgb_to_linear(188 / 255.0f);  // an integer pixel value, as in pictures
  Sweep sweep{.stem = "reach",
              .title = "A black ball under an even sky, over the distance from it",
              .x_label = "distance on the floor from the ball's foot, m",
              .y_label = "change of the floor, code values",
              .x = {}};
  for (int i = 0; i < 16; ++i) sweep.x.push_back(0.1 + 0.05 * i);
  ClosedScene scene;
  scene.width = 72;
  scene.height = 54;
  scene.focal_px = 60;
  scene.extent = {Eigen::Vector3f(-1.2f, -1.2f, -0.1f), Eigen::Vector3f(1.2f, 1.2f, 0.1f)};
  scene.eye_m = {0, -0.9f, 1.3f};
  scene.look_at_m = {0, -0.45f, 0};
  scene.radiance = [level](const Eigen::Vector3f&) { return level; };
  scene.exhibit.objects = {sphere_object(radius_m, {0, 0, height_m}, 0)};
  // Derivative of pixel values by radiance at this level: the slope of the sRGB curve.
  const double slope = 255 * 1.055 / 2.4 * std::pow(level, 1 / 2.4 - 1);
  std::vector<double> want(sweep.x.size(), 0.0);
  for (const Method& method : methods(64, 1)) {
    std::vector<double> got(sweep.x.size(), 0.0), answer(got), areas(got);
    for_each_floor_pixel(
        scene, relit(scene, method.plan), [&](const Eigen::Vector3f& p, const Eigen::Vector3f& delta, float area_m2) {
          const float far2 = (p - Eigen::Vector3f(0, 0, height_m)).squaredNorm();
          const auto i = std::lround((p.norm() - sweep.x[0]) / 0.05);
          if (p.y() > 0 || i < 0 || i >= static_cast<long>(got.size())) return;
          const auto k = static_cast<std::size_t>(i);
          got[k] += slope * delta.x() * area_m2;
          answer[k] -= slope * level * height_m * radius_m * radius_m / (far2 * std::sqrt(far2)) * area_m2;
          areas[k] += area_m2;
        });
    for (std::size_t i = 0; i < got.size(); ++i) {
      got[i] /= areas[i];
      want[i] = answer[i] / areas[i];
    }
    sweep.curves.push_back({method.name, got});
  }
  sweep.curves.push_back({"closed form", want, true});
  write_sweep(sweep);
  for (const Curve& curve : sweep.curves) {
    for (std::size_t i = 0; i < want.size(); ++i) {
      const std::string where = curve.name + " at " + std::to_string(sweep.x[i]) + " m";
      // One pixel value; two where live settings fade out the change, and for propagation.
      const double tolerance = std::max(curve.name == "cones, careful" ? 1.0 : 2.0, 0.12 * std::abs(want[i]));
      EXPECT_NEAR(curve.y[i], want[i], tolerance) << where;
      // No sudden end: from one distance to the next it falls by at most the expected change plus 1.5 pixel values.
      if (i > 0) {
        EXPECT_LT(curve.y[i] - curve.y[i - 1], want[i] - want[i - 1] + 1.5) << where;
      }
    }
  }
}

}  // namespace
}  // namespace lumigraft::test
