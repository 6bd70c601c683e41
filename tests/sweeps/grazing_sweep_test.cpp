// Cones along the surface at their origin, and through slits.
#include <numbers>

#include "tests/sweeps/sweep.h"

namespace lumigraft::test {
namespace {

class GrazingSweep : public SweepTest {};
ON_VULKAN(GrazingSweep);

/// A white plate in the air, rotated about the y axis so that its faces are not aligned with voxels; seen from above.
ClosedScene plate(float tilt) {
  ClosedScene scene;
  scene.width = 48;
  scene.height = 36;
  scene.focal_px = 40;
  scene.eye_m = {0, -0.35f, 0.9f};
  scene.look_at_m = {0, 0, 0.45f};
  scene.exhibit.objects = {box_object({-0.15f, -0.15f, -0.02f}, {0.15f, 0.15f, 0.02f}, 1)};
  scene.exhibit.objects[0].position_m = {0, 0, 0.45};
  scene.exhibit.objects[0].rotation = Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitY());
  return scene;
}

/// Visits the radiance of pixels well inside the plate's upper face.
template <typename Visit>
void for_each_pixel_of_plate(const ClosedScene& scene, float tilt, const relight::RelitPicture& picture,
                             const Visit& visit) {
  const Eigen::Matrix3f turn = Eigen::AngleAxisf(tilt, Eigen::Vector3f::UnitY()).toRotationMatrix();
  const Eigen::Vector3f up = turn.col(2), top = Eigen::Vector3f(0, 0, 0.45f) + 0.02f * up;
  const capture::CameraModel model = scene.session().color.model;
  int count = 0;
  for (int v = 0; v < scene.height; ++v) {
    for (int u = 0; u < scene.width; ++u) {
      const Eigen::Vector3f w = (scene.T_tag_camera().linear() * *model.unproject({u, v})).cast<float>();
      const Eigen::Vector3f p = scene.eye_m + w * (up.dot(top - scene.eye_m) / up.dot(w));
      if ((turn.transpose() * (p - top)).cwiseAbs().maxCoeff() > 0.12f) continue;
      visit(p, up, picture_radiance(picture, u, v));
      ++count;
    }
  }
  EXPECT_GT(count, 60);
}

// Nothing is above the plate: under a uniform sky it is as bright as the sky, and under a distant lamp the irradiance
// follows the cosine. Cones that intersect the plate at their origin would make it darker.
TEST_P(GrazingSweep, NothingShadowsAPlate) {
  Sweep sweep{.stem = "grazing-plate",
              .title = "A plate with nothing above it: darkest pixel",
              .x_label = "tilt of the plate, degrees",
              .y_label = "radiance / closed form",
              .x = {0, 15, 40},
              .min = 0.97,
              .max = 1.03};
  for (const Method& method : methods(32, 1)) {
    if (method.plan.method == "dlpv") continue;  // objects are lit by cones there too
    for (const bool by_lamp : {false, true}) {
      Curve& curve = sweep.curves.emplace_back(Curve{method.name + (by_lamp ? ", lamp at 8°" : ", sky")});
      for (const double degrees : sweep.x) {
        const float tilt = static_cast<float>(degrees) * std::numbers::pi_v<float> / 180;
        ClosedScene scene = plate(tilt);
        const Eigen::Vector3f up = Eigen::AngleAxisf(tilt, Eigen::Vector3f::UnitY()) * Eigen::Vector3f::UnitZ();
        if (by_lamp) {
          scene.sky = 0;
          scene.radiance = [](const Eigen::Vector3f&) { return 0.0f; };
          // 8° above the plate's plane, perpendicular to its tilt.
          const Eigen::Vector3f w = std::sin(0.14f) * up + std::cos(0.14f) * Eigen::Vector3f::UnitY();
          reconstruct::PointLight lamp;
          lamp.direction = w;
          lamp.irradiance.setConstant(12);
          lamp.angular_radius_rad = 0.01f;
          scene.lamps = {lamp};
        } else {
          scene.sky = 0.5f;
        }
        double darkest = 9;
        const relight::RelitPicture picture = relit(scene, method.plan);
        for_each_pixel_of_plate(scene, tilt, picture, [&](const Eigen::Vector3f&, const Eigen::Vector3f&, float got) {
          darkest =
              std::min(darkest, double{got} / (by_lamp ? 12 * std::sin(0.14f) / std::numbers::pi_v<float> : 0.5f));
        });
        curve.y.push_back(darkest);
      }
    }
  }
  expect_within_bounds(sweep);
}

// A slit between two black plates: the loss of sky light on the floor, compared with ray casting.
TEST_P(GrazingSweep, ASlit) {
  Sweep sweep{.stem = "slit",
              .title = "Two plates with a slit, 10 cm above the floor",
              .x_label = "width of the slit, mm",
              .y_label = "fraction of the sky's light left below the slit",
              .x = {5, 20, 80},
              .logarithmic = true};
  ClosedScene scene;
  scene.width = 64;
  scene.height = 48;
  scene.focal_px = 100;
  scene.eye_m = {0, -0.8f, 0.09f};
  scene.look_at_m = {0, -0.05f, 0};
  constexpr float height_m = 0.1f, half_m = 0.2f, sky = 0.9f;
  scene.sky = sky;
  scene.radiance = [](const Eigen::Vector3f&) { return 0.5f * sky; };
  std::vector<double> answer;
  for (const Method& method : methods(64, 1)) {
    Curve& curve = sweep.curves.emplace_back(Curve{method.name});
    for (const double x : sweep.x) {
      const float slit_m = 5e-4f * static_cast<float>(x);
      scene.exhibit.objects = {box_object({-half_m, -half_m, height_m}, {-slit_m, half_m, height_m + 0.01f}, 0),
                               box_object({slit_m, -half_m, height_m}, {half_m, half_m, height_m + 0.01f}, 0)};
      const relight::RelitPicture picture = relit(scene, method.plan);
      double left = 0, want = 0, open_sky = 0;
      for_each_floor_pixel(scene, picture, [&](const Eigen::Vector3f& p, const Eigen::Vector3f& delta, float area_m2) {
        if (std::abs(p.x()) > 0.03f || std::abs(p.y()) > 0.08f) return;
        constexpr int rays = 1024;
        int open = 0;
        for (int i = 0; i < rays; ++i) {  // cosine-weighted
          const float s = std::sqrt((static_cast<float>(i) + 0.5f) / rays), phi = 2.39996323f * static_cast<float>(i);
          const Eigen::Vector3f w(s * std::cos(phi), s * std::sin(phi), std::sqrt(1 - s * s));
          const auto blocks = [&](float h) {
            const Eigen::Vector3f at = p + w * (h / w.z());
            return std::abs(at.x()) > slit_m && at.head<2>().cwiseAbs().maxCoeff() < half_m;
          };
          open += !blocks(height_m) && !blocks(height_m + 0.01f);
        }
        left += area_m2 * (0.5 * sky + delta.x());
        want += area_m2 * 0.5 * sky * open / rays;
        open_sky += area_m2 * 0.5 * sky;
      });
      curve.y.push_back(left / open_sky);
      if (answer.size() < sweep.x.size()) answer.push_back(want / open_sky);
    }
  }
  sweep.curves.push_back({"rays", answer, true});
  write_sweep(sweep);
  for (const Curve& curve : sweep.curves) {
    for (std::size_t i = 0; i < sweep.x.size(); ++i) {
      const double max = (curve.name == "cones, careful" ? 0.12
                          : curve.name == "cones, live"  ? 0.35
                                                         : 0.45) *
                         (1 - answer[i]);  // of the loss
      EXPECT_NEAR(curve.y[i], answer[i], max) << curve.name << ", " << sweep.x[i] << " mm";
    }
  }
}

}  // namespace
}  // namespace lumigraft::test
