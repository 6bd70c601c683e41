// Light from one surface to a close one, where sums over point lights have a singularity.
#include <numbers>

#include "tests/sweeps/sweep.h"

namespace lumigraft::test {
namespace {

class NearSurfaceSweep : public SweepTest {};
ON_VULKAN(NearSurfaceSweep);

constexpr float kFaceHalf_m = 0.15f, kFaceHeight_m = 0.2f;  // half width and height of the lit face

/// Form factor from a floor point to an upright rectangle that stands on the floor; the point is y in front of the foot
/// of one of its vertical edges (Siegel & Howell 1992, appendix C, differential element to a rectangle at right
/// angles).
double corner(double y, double width, double height) {
  const double r = std::hypot(y, height);
  return 1 / (2 * std::numbers::pi) * (std::atan(width / y) - y / r * std::atan(width / r));
}

// A sun at the horizon lights a box's vertical face uniformly, and not the floor in front of it. The face emits B = ρ
// (E / π + L / 2), L that of the floor, and the floor's change is its albedo times B times the form factor, 0.5 at the
// face's foot. Point lights on the face would sum up to 1/d² there, and clamping them would lose light.
TEST_P(NearSurfaceSweep, BeforeALitFace) {
  Sweep sweep{.stem = "near-surface",
              .title = "Floor before a lit face, over the distance from it",
              .x_label = "distance from the face, mm",
              .y_label = "change / closed form",
              .x = {6, 12, 24, 48, 96, 192},
              .logarithmic = true};
  constexpr float irradiance = 4, rho = 0.8f, floor_radiance = 0.2f;
  ClosedScene scene;
  scene.width = 64;
  scene.height = 48;
  scene.focal_px = 53;
  scene.albedo = 0.1f;
  scene.sky = 0;
  scene.radiance = [](const Eigen::Vector3f&) { return floor_radiance; };
  reconstruct::PointLight sun;
  sun.direction = {0, -1, 0};
  sun.irradiance.setConstant(irradiance);
  sun.angular_radius_rad = 0.0047f;
  scene.lamps = {sun};
  scene.exhibit.objects = {box_object({-kFaceHalf_m, 0, 0.0005f}, {kFaceHalf_m, 0.1f, kFaceHeight_m}, rho)};
  const double sent = rho * (irradiance / std::numbers::pi_v<float> + 0.5 * floor_radiance);
  for (const Method& method : methods(64, 2)) {
    std::vector<double> got(sweep.x.size(), 0.0), want(got);
    std::vector<int> counts(sweep.x.size(), 0);
    for (const bool close : {true, false}) {  // one picture does not have enough pixels for all distances
      scene.eye_m = close ? Eigen::Vector3f(0, -0.05f, 0.06f) : Eigen::Vector3f(0, -0.5f, 0.5f);
      scene.look_at_m = {0, close ? -0.018f : -0.13f, 0};
      for_each_floor_pixel(
          scene, relit(scene, method.plan), [&](const Eigen::Vector3f& p, const Eigen::Vector3f& delta, float area_m2) {
            const auto i = static_cast<std::size_t>(std::lround(std::log2(std::max(p.y() / -0.006f, 0.5f))));
            if (std::abs(p.x()) > 0.05f || p.y() > -0.0043f || i >= got.size() || close != (i < 3)) return;
            got[i] += delta.x() * area_m2;
            want[i] += scene.albedo * sent * area_m2 *
                       (corner(-p.y(), kFaceHalf_m - p.x(), kFaceHeight_m) +
                        corner(-p.y(), kFaceHalf_m + p.x(), kFaceHeight_m));
            ++counts[i];
          });
    }
    Curve& curve = sweep.curves.emplace_back(Curve{method.name});
    for (std::size_t i = 0; i < got.size(); ++i) {
      EXPECT_GT(counts[i], 8) << i;
      curve.y.push_back(got[i] / want[i]);
    }
  }
  write_sweep(sweep);
  for (const Curve& curve : sweep.curves) {
    // Emitted light is stored in voxels of 7.5 mm, twice that for propagation: closer to the face, light may be
    // missing.
    const double voxel_mm = curve.name == "propagation" ? 15 : 7.5;
    for (std::size_t i = 0; i < sweep.x.size(); ++i) {
      const std::string where = curve.name + " at " + std::to_string(sweep.x[i]) + " mm";
      EXPECT_GE(curve.y[i], sweep.x[i] < voxel_mm ? 0.5 : 0.75) << where;
      EXPECT_LE(curve.y[i], 1.25) << where;
    }
  }
}

}  // namespace
}  // namespace lumigraft::test
