// Glossy reflection from mirror to matt.
#include <map>
#include <numbers>

#include "tests/sweeps/sweep.h"

namespace lumigraft::test {
namespace {

class RoughnessSweep : public SweepTest {};
ON_VULKAN(RoughnessSweep);

// A metal ball over a desk with a lamp's pool of light: deviation from the path tracer over roughness.
TEST_P(RoughnessSweep, MetalBallOverALitDesk) {
  Sweep sweep{.stem = "roughness",
              .title = "A metal ball over a lit desk, compared with the path tracer",
              .x_label = "roughness",
              .y_label = "RMS deviation / mean radiance",
              .x = {0.02, 0.2, 1},
              .logarithmic = true,
              .max = 0.35};
  const reconstruct::PointLight lamp = lamp_at({-0.1f, 0.1f, 0.8f}, 0.1f, 0.35f);
  ClosedScene scene;
  scene.width = 48;
  scene.height = 36;
  scene.focal_px = 90;
  scene.eye_m = {0, -0.7f, 0.35f};
  scene.look_at_m = {0, 0, 0.12f};
  scene.sky = 0.1f;
  scene.lamps = {lamp};
  scene.radiance = [lamp](const Eigen::Vector3f& p) {
    return 0.05f + 0.5f / std::numbers::pi_v<float> * irradiance(lamp, {p.x(), p.y(), 0}, Eigen::Vector3f::UnitZ());
  };
  for (const Method& method : methods(64, 2)) {
    if (method.plan.method != "dlpv") sweep.curves.push_back({method.name});
  }
  for (const double roughness : sweep.x) {
    scene.exhibit.objects = {sphere_object(0.1f, {0, 0, 0.13f}, 0.9f)};
    relight::MaterialOverride& material = scene.exhibit.objects[0].material;
    material.metallic = 1;
    material.specular = 1;
    material.roughness = static_cast<float>(roughness);
    static std::map<double, relight::RelitPicture> truths;  // shared by both devices
    if (!truths.count(roughness)) truths[roughness] = reference(scene, 128);
    const relight::RelitPicture& truth = truths[roughness];
    for (std::size_t c = 0; c < sweep.curves.size(); ++c) {
      const relight::RelitPicture picture = relit(scene, methods(64, 2)[c].plan);
      double squares = 0, sum = 0;
      int count = 0;
      for (int v = 0; v < scene.height; ++v) {
        for (int u = 0; u < scene.width; ++u) {
          if (picture.maps->mask.at(u, v) < 1 || truth.maps->mask.at(u, v) < 0.99f) continue;
          const double t = picture_radiance(truth, u, v), off = picture_radiance(picture, u, v) - t;
          squares += off * off;
          sum += t;
          ++count;
        }
      }
      EXPECT_GT(count, 150);
      sweep.curves[c].y.push_back(std::sqrt(squares / count) / (sum / count));
    }
  }
  expect_within_bounds(sweep);
}

}  // namespace
}  // namespace lumigraft::test
