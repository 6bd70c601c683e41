// Colour bleeding to wrong places.
#include <numbers>

#include "tests/sweeps/sweep.h"

namespace lumigraft::test {
namespace {

class BleedingSweep : public SweepTest {};
ON_VULKAN(BleedingSweep);

constexpr float kHalf_m = 0.08f;

// A green case on a white desk, lit by a lamp from one side: near its lit face the desk turns green; on the other side
// it lies in shadow and must not. Reference: green minus red of the path tracer.
TEST_P(BleedingSweep, GreenCaseOnAWhiteDesk) {
  const reconstruct::PointLight lamp = lamp_at({0.5f, 0, 0.55f}, 0.03f, 0.8f);
  ClosedScene scene;
  scene.width = 72;
  scene.height = 54;
  scene.focal_px = 60;
  scene.albedo = 0.8f;
  scene.sky = 0;
  scene.lamps = {lamp};
  scene.radiance = [lamp](const Eigen::Vector3f& p) {
    return 0.8f / std::numbers::pi_v<float> * irradiance(lamp, {p.x(), p.y(), 0}, Eigen::Vector3f::UnitZ());
  };
  scene.exhibit.objects = {box_object({-kHalf_m, -kHalf_m, 0.001f}, {kHalf_m, kHalf_m, 2 * kHalf_m}, 0)};
  scene.exhibit.objects[0].material.base_color = {0.05f, 0.7f, 0.05f};
  scene.eye_m = {0, -0.5f, 0.75f};
  scene.look_at_m = {0, -0.02f, 0};
  Sweep sweep{.stem = "bleeding-green-case",
              .title = "Green case on a white desk, lamp at the right",
              .x_label = "distance from the case's middle towards the lamp, m",
              .y_label = "green less red, of the desk's radiance",
              .x = {}};
  const float step_m = 0.03f;
  for (const int i : {-6, -5, -4, -3, -2, -1, 1, 2, 3, 4, 5, 6}) sweep.x.push_back(step_m * i + (i < 0 ? -0.07 : 0.07));
  const auto curve_of = [&](const relight::RelitPicture& picture) {
    std::vector<double> sums(sweep.x.size(), 0.0), all(sweep.x.size(), 0.0);
    for_each_floor_pixel(scene, picture, [&](const Eigen::Vector3f& p, const Eigen::Vector3f& delta, float) {
      if (std::abs(p.y()) > 0.5f * kHalf_m) return;
      for (std::size_t i = 0; i < sums.size(); ++i) {
        if (std::abs(p.x() - sweep.x[i]) > 0.5f * step_m) continue;
        sums[i] += delta.y() - delta.x();
        all[i] += scene.radiance(p);
      }
    });
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i] /= all[i];
    return sums;
  };
  for (const Method& method : methods(64, 2)) {
    sweep.curves.push_back({method.name, curve_of(relit(scene, method.plan))});
  }
  static const std::vector<double> answer = curve_of(reference(scene, 256));  // shared by both devices
  sweep.curves.push_back({"path tracer", answer, true});
  write_sweep(sweep);
  for (const Curve& curve : sweep.curves) {
    double squares = 0, all = 0;
    for (std::size_t i = 0; i < answer.size(); ++i) {
      squares += std::pow(curve.y[i] - answer[i], 2);
      all += answer[i] * answer[i];
      // In the shadow at most one pixel value: by the slope of the sRGB curve there.
      const double level = scene.radiance({static_cast<float>(sweep.x[i]), 0, 0});
      const double codes = 255 * 1.055 / 2.4 * std::pow(level, 1 / 2.4) * std::abs(curve.y[i] - answer[i]);
      if (sweep.x[i] < 0) {
        EXPECT_LT(codes, 1) << curve.name << " in the shadow at " << sweep.x[i];
      }
    }
    EXPECT_LT(std::sqrt(squares / all), curve.name == "propagation" ? 0.3 : 0.12) << curve.name;
  }
}

}  // namespace
}  // namespace lumigraft::test
