// Coverage of pixels at the outline of an object, through lenses with strong distortion.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

#include "relight/reference/reference_renderer.h"
#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector3f;

constexpr float kRadius_m = 0.18f;
const Vector3f kCentre_m(0.14f, 0.1f, 0.3f);  // off the optical axis, where the lens bends most

/// A ball over a floor that does not hide it.
ClosedScene ball_over_floor() {
  ClosedScene scene;
  scene.eye_m = {0, -0.8f, 0.7f};
  scene.look_at_m = {0, 0, 0.15f};
  scene.lamps = {lamp_at({0.5f, -0.5f, 1.5f}, 0.05f, 2)};
  scene.exhibit.objects = {sphere_object(kRadius_m, kCentre_m, 0.7f)};
  return scene;
}

/// Part of the pixel in which rays meet the ball.
float true_coverage(const ClosedScene& scene, const capture::CameraModel& camera, int u, int v) {
  constexpr int kRays = 16;
  const Eigen::Matrix3d R_tag_camera = scene.T_tag_camera().linear();
  int met = 0;
  for (int k = 0; k < kRays * kRays; ++k) {
    const double x = (k % kRays + 0.5) / kRays - 0.5, y = static_cast<double>(k / kRays) / kRays + 0.5 / kRays - 0.5;
    const auto ray = camera.unproject({u + x, v + y});
    if (!ray) continue;
    const Vector3f w = (R_tag_camera * *ray).cast<float>(), to = kCentre_m - scene.eye_m;
    met += to.cross(w).norm() < kRadius_m && to.dot(w) > 0;
  }
  return static_cast<float>(met) / (kRays * kRays);
}

constexpr std::array<double, 5> kBarrel{-0.3, 0.08, 0.003, -0.002, 0}, kPincushion{0.25, -0.05, 0, 0.004, 0};

/// `make(session)` creates a renderer.
template <typename Make>
void outline_is_where_the_lens_shows_it(const Make& make, const relight::Plan& plan,
                                        const std::vector<std::array<double, 5>>& lenses = {kBarrel, kPincushion}) {
  const ClosedScene scene = ball_over_floor();
  for (const std::array<double, 5>& distortion : lenses) {
    capture::Session session = scene.session();
    session.color.model.distortion = distortion;
    capture::FrameSet frame = scene.frame();
    frame.depth = nullptr;  // of a lens without distortion
    const relight::RelitPicture picture = make(session)->relight(frame, scene.scene(), scene.exhibit, plan, true);
    ASSERT_TRUE(picture.maps);
    capture::Image<float> truth(scene.width, scene.height, 1);
    for (int v = 0; v < scene.height; ++v)
      for (int u = 0; u < scene.width; ++u) truth.at(u, v) = true_coverage(scene, session.color.model, u, v);
    double error = 0;
    int near = 0, divided = 0;
    for (int v = 4; v < scene.height - 4; ++v) {
      for (int u = 4; u < scene.width - 4; ++u) {
        float least = 1, most = 0;
        for (int y = -4; y <= 4; ++y) {
          for (int x = -4; x <= 4; ++x) {
            least = std::min(least, truth.at(u + x, v + y));
            most = std::max(most, truth.at(u + x, v + y));
          }
        }
        if (least == most) continue;
        error += std::abs(picture.maps->mask.at(u, v) - truth.at(u, v));
        divided += truth.at(u, v) > 0 && truth.at(u, v) < 1;
        ++near;
      }
    }
    ASSERT_GT(divided, 60);
    error /= near;
    std::printf("outline: %-9s at 1/%d, k1 %5.2f: %.3f of coverage off within 4 px\n", plan.method.c_str(),
                plan.trace_scale, distortion[0], error);
    EXPECT_LT(error, 0.04) << plan.method << ", k1 " << distortion[0];
  }
}

TEST(Silhouettes, OfRays) {
  const auto make = [](const capture::Session& session) { return std::make_unique<relight::RayRenderer>(session); };
  outline_is_where_the_lens_shows_it(make, rays_plan(2, 4), {kBarrel});
  outline_is_where_the_lens_shows_it(make, rays_plan(8, 4), {kPincushion});
}

TEST(Silhouettes, OfTheReference) {
  relight::Plan plan;
  plan.method = "reference";
  plan.samples = 8;
  outline_is_where_the_lens_shows_it(
      [](const capture::Session& session) { return std::make_unique<relight::ReferenceRenderer>(session); }, plan,
      {kBarrel});
}

class SilhouettesOnDevices : public ClosedTest {};
ON_BOTH_DEVICES(SilhouettesOnDevices);

TEST_P(SilhouettesOnDevices, OfCones) {
  const auto make = [&](const capture::Session& session) {
    return std::make_unique<relight::Relighter>(device_, session);
  };
  relight::Plan full = live_plan();
  full.trace_scale = 2;
  outline_is_where_the_lens_shows_it(make, live_plan(), {kBarrel});
  outline_is_where_the_lens_shows_it(make, full, {kPincushion});
}

}  // namespace
}  // namespace lumigraft::test
