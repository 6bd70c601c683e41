// Width of penumbrae.
#include <numbers>

#include "tests/sweeps/sweep.h"

namespace lumigraft::test {
namespace {

class PenumbraSweep : public SweepTest {};
ON_VULKAN(PenumbraSweep);

constexpr float kEdge_m = 0.25f, kLamp_m = 1;  // heights

/// Fraction of a round lamp occluded by the half plane x < 0 at the edge's height, from a point of the floor.
double hidden_fraction(const Eigen::Vector3f& p, float radius_m) {
  // The edge projected from p to the lamp's height, as offset from the lamp's centre.
  const float at_m = p.x() + (0 - p.x()) * kLamp_m / kEdge_m;
  const double c = std::clamp(static_cast<double>(at_m / radius_m), -1.0, 1.0);
  return 0.5 + (c * std::sqrt(1 - c * c) + std::asin(c)) / std::numbers::pi;
}

// A half plane between a round lamp and a floor: width of the shadow's edge, from ∫ s (1 - s) dx over the occluded
// fraction s, compared with that of a disc cut by a straight line. Shadows at voxel resolution would be at least 20 mm
// wide.
TEST_P(PenumbraSweep, WidthOverTheLampsRadius) {
  Sweep sweep{.stem = "penumbra-lamp-size",
              .title = "Penumbra of a straight edge",
              .x_label = "radius of the lamp, mm",
              .y_label = "width of the edge, mm",
              .x = {10, 30, 150}};
  ClosedScene scene;
  scene.width = 120;
  scene.height = 40;
  scene.focal_px = 260;
  scene.eye_m = {0.02f, -0.9f, 0.2f};
  scene.look_at_m = {0.02f, 0, 0};
  scene.sky = 0;
  std::vector<double> wants;
  scene.exhibit.objects = {box_object({-0.35f, -0.35f, kEdge_m}, {0, 0.35f, kEdge_m + 0.004f}, 0)};
  for (const Method& method : methods(64, 1)) {
    if (method.plan.method == "dlpv") continue;  // same lamps
    Curve& curve = sweep.curves.emplace_back(Curve{method.name});
    for (const double x : sweep.x) {
      const float radius_m = 1e-3f * static_cast<float>(x);
      const reconstruct::PointLight lamp = lamp_at({0, 0, kLamp_m}, radius_m, 1);
      scene.lamps = {lamp};
      scene.radiance = [lamp](const Eigen::Vector3f& p) {
        return 0.5f / std::numbers::pi_v<float> * irradiance(lamp, {p.x(), p.y(), 0}, Eigen::Vector3f::UnitZ());
      };
      const relight::RelitPicture picture = served(scene, method.plan);
      double width = 0, want = 0, area = 0;
      for_each_floor_pixel(scene, picture, [&](const Eigen::Vector3f& p, const Eigen::Vector3f& delta, float area_m2) {
        if (std::abs(p.y()) > 0.15f || std::abs(p.x()) > 0.02f + 0.5f * radius_m) return;
        const double s = std::clamp(-static_cast<double>(delta.x()) / scene.radiance(p), 0.0, 1.0);
        const double t = hidden_fraction(p, radius_m);
        width += s * (1 - s) * area_m2;
        want += t * (1 - t) * area_m2;
        area += area_m2;
      });
      // A ramp of width w has ∫ s (1 - s) dx = w/6.
      const double mm = 6 * 1e3 * 2 * (0.02 + 0.5 * radius_m) / area;
      curve.y.push_back(mm * width);
      if (wants.size() < sweep.x.size()) wants.push_back(mm * want);
    }
  }
  sweep.curves.push_back({"closed form", wants, true});
  write_sweep(sweep);
  constexpr double voxel_mm = 20;  // voxel size of the volumes
  for (const Curve& curve : sweep.curves) {
    for (std::size_t i = 0; i < wants.size(); ++i) {
      EXPECT_NEAR(curve.y[i], wants[i], 0.1 * wants[i] + 0.5 * voxel_mm) << curve.name << ", " << sweep.x[i] << " mm";
    }
  }
}

// A box on the floor with a small lamp at 45° behind it: from the first millimetre behind its foot all of the lamp's
// light is removed. Offsets against self-shadowing would leave a bright seam there ("peter-panning").
TEST_P(PenumbraSweep, ShadowBeginsAtTheFoot) {
  Sweep sweep{.stem = "contact-shadow",
              .title = "Shadow behind the foot of a box",
              .x_label = "distance from the box, mm",
              .y_label = "fraction of the lamp's light that is taken",
              .x = {2, 4, 8, 16, 32},
              .logarithmic = true,
              .min = 0.95,
              .max = 1.02};
  const reconstruct::PointLight lamp = lamp_at({0, 1, 1}, 0.01f, 1);
  ClosedScene scene;
  scene.width = 64;
  scene.height = 48;
  scene.focal_px = 150;
  scene.eye_m = {0, -0.15f, 0.1f};
  scene.look_at_m = {0, -0.005f, 0};
  scene.sky = 0;
  scene.lamps = {lamp};
  scene.radiance = [lamp](const Eigen::Vector3f& p) {
    return 0.5f / std::numbers::pi_v<float> * irradiance(lamp, {p.x(), p.y(), 0}, Eigen::Vector3f::UnitZ());
  };
  scene.exhibit.objects = {box_object({-0.1f, 0, 0}, {0.1f, 0.1f, 0.2f}, 0)};
  for (const Method& method : methods(64, 1)) {
    if (method.plan.method == "dlpv") continue;
    std::vector<double> taken(sweep.x.size(), 0.0), all(taken);
    for_each_floor_pixel(
        scene, served(scene, method.plan), [&](const Eigen::Vector3f& p, const Eigen::Vector3f& delta, float area_m2) {
          const long i = std::lround(std::log2(std::max(-p.y() / 2e-3f, 0.1f)));
          if (p.y() > -0.0014f || std::abs(p.x()) > 0.06f || i < 0 || i >= static_cast<long>(taken.size())) return;
          taken[static_cast<std::size_t>(i)] -= delta.x() * area_m2;
          all[static_cast<std::size_t>(i)] += scene.radiance(p) * area_m2;
        });
    Curve& curve = sweep.curves.emplace_back(Curve{method.name});
    for (std::size_t i = 0; i < taken.size(); ++i) curve.y.push_back(taken[i] / all[i]);
  }
  expect_within_bounds(sweep);
}

}  // namespace
}  // namespace lumigraft::test
