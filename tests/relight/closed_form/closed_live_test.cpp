// Approximations of the live setting, each compared with the exact computation.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

/// A bright ball next to a lamp over a grey floor: it lights the floor well outside its shadow.
ClosedScene bright_ball() {
  ClosedScene scene;
  scene.width = 192;
  scene.height = 144;
  scene.focal_px = 160;
  scene.sky = 0.1f;
  scene.radiance = [](const Eigen::Vector3f& p) { return 0.15f + 0.1f * p.x() * p.x(); };
  scene.lamps = {lamp_at({0.15f, 0.05f, 0.35f}, 0.02f, 0.1f)};
  scene.exhibit.objects = {sphere_object(0.12f, {-0.1f, 0, 0.15f}, 0.9f)};
  return scene;
}

struct Difference {
  double rms_codes = 0;
  int worst_codes = 0, changed = 0;  ///< the latter: values of the first that are not those of `unchanged`
};

Difference difference(const capture::Image<std::uint8_t>& a, const capture::Image<std::uint8_t>& b,
                      const capture::Image<std::uint8_t>& unchanged) {
  Difference d;
  for (std::size_t i = 0; i < a.data.size(); ++i) {
    const int codes = std::abs(a.data[i] - b.data[i]);
    d.worst_codes = std::max(d.worst_codes, codes);
    d.rms_codes += codes * codes;
    d.changed += std::abs(a.data[i] - unchanged.data[i]) > 1;
  }
  d.rms_codes = std::sqrt(d.rms_codes / static_cast<double>(a.data.size()));
  return d;
}

class ClosedLive : public ClosedTest {
 protected:
  capture::Image<std::uint8_t> camera_picture(ClosedScene scene) const {
    scene.exhibit.objects.clear();
    return relit(scene, live_plan(64)).srgb;
  }
};
ON_BOTH_DEVICES(ClosedLive);

// Without maps, smooth light changes are computed for one pixel of 4 × 4; with maps, for each.
TEST_P(ClosedLive, OnePixelOfSixteenRepresentsTheSmoothOnes) {
  const ClosedScene scene = bright_ball();
  relight::Relighter relighter(device_, scene.session());
  const auto every = relighter.relight(scene.frame(), scene.scene(), scene.exhibit, live_plan(64), true).srgb;
  const auto some = relighter.relight(scene.frame(), scene.scene(), scene.exhibit, live_plan(64)).srgb;
  const Difference d = difference(some, every, camera_picture(scene));
  RecordProperty("rms_codes", std::to_string(d.rms_codes));
  EXPECT_GT(d.changed, 192 * 144 * 3 / 8);  // of three times as many values
  EXPECT_LT(d.rms_codes, 0.14);
  EXPECT_LE(d.worst_codes, 3);
}

// A ball's shadow on the floor from the lamp's shadow map, compared with the analytic occlusion of the lamp's disk by
// the ball's disk as seen from the floor (both small, so flat).
TEST_P(ClosedLive, LampMapsHoldTheOccludedFractionOfTheLamp) {
  ClosedScene scene = bright_ball();
  const float radius = 0.1f;
  const Eigen::Vector3f centre(-0.1f, 0, 0.25f);
  const reconstruct::PointLight lamp = lamp_at({0.3f, 0.1f, 1.1f}, 0.06f, 1);
  scene.lamps = {lamp};
  scene.sky = 0;
  scene.radiance = [&](const Eigen::Vector3f& p) {
    return 0.5f / std::numbers::pi_v<float> * irradiance(lamp, {p.x(), p.y(), 0}, Eigen::Vector3f::UnitZ());
  };
  scene.exhibit.objects = {sphere_object(radius, centre, 0)};
  relight::Relighter relighter(device_, scene.session());
  const relight::RelitPicture picture = relighter.relight(scene.frame(), scene.scene(), scene.exhibit, live_plan(64));
  double squares = 0;
  int pixels = 0, half_shadow = 0;
  for (int v = 0; v < scene.height; ++v) {
    for (int u = 0; u < scene.width; ++u) {
      const Eigen::Vector3f p = scene.on_plane(u, v), to = p - scene.eye_m, w = (lamp.position_m - p).normalized();
      const float near = (centre - scene.eye_m).cross(to.normalized()).norm();
      if (near < radius + 0.01f || p.norm() > 0.7f) continue;  // the ball shows, or covers part of the pixel
      int hidden = 0;
      constexpr int rays = 400;
      const Eigen::Vector3f x = w.unitOrthogonal(), y = w.cross(x);
      for (int i = 0; i < rays; ++i) {
        const float r = lamp.radius_m * std::sqrt((static_cast<float>(i) + 0.5f) / rays);
        const float phi = 2.39996323f * static_cast<float>(i);
        const Eigen::Vector3f ray = (lamp.position_m + r * (std::cos(phi) * x + std::sin(phi) * y) - p).normalized();
        hidden += (centre - p).cross(ray).norm() < radius && ray.dot(centre - p) > 0;
      }
      const double truth = static_cast<double>(hidden) / rays;
      const double lost = 1 - picture_radiance(picture, u, v) / scene.radiance(p);
      squares += (lost - truth) * (lost - truth);
      half_shadow += truth > 0.1 && truth < 0.9;
      ++pixels;
    }
  }
  EXPECT_GT(half_shadow, 100);
  RecordProperty("rms_error", std::to_string(std::sqrt(squares / pixels)));
  EXPECT_LT(std::sqrt(squares / pixels), 0.02);
}

// Compares gathering per cell of 2³ voxels with tracing per pixel with several times the cones.
TEST_P(ClosedLive, CellsRepresentTracedPixels) {
  const ClosedScene scene = bright_ball();
  relight::Relighter relighter(device_, scene.session());
  const auto live = relighter.relight(scene.frame(), scene.scene(), scene.exhibit, live_plan(64)).srgb;
  const auto traced = relighter.relight(scene.frame(), scene.scene(), scene.exhibit, careful_plan(64)).srgb;
  const Difference d = difference(live, traced, camera_picture(scene));
  RecordProperty("rms_codes", std::to_string(d.rms_codes));
  EXPECT_LT(d.rms_codes, 0.8);
}

}  // namespace
}  // namespace lumigraft::test
