// Under a uniform sky: all visible radiances are equal, so only form factors matter.
#include <cmath>
#include <numbers>
#include <string>

#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

class ClosedSky : public ClosedTest {};
ON_BOTH_DEVICES(ClosedSky);

/// Mean and maximum magnitude over pixels of a picture.
struct Spread {
  double sum = 0, max = 0;
  int count = 0;
  void add(double x) {
    sum += x;
    max = std::max(max, std::abs(x));
    ++count;
  }
  double mean() const { return sum / count; }
};

// Furnace: where sky and floor have radiance L and nothing absorbs, an object emits L too, and nothing changes. Bounces
// are gathered iteratively from the light of the previous one: in the first the object is dark for the floor, with two
// the object lacks what the floor lacked, with three the floor what the object lacked. Each iteration reduces the rest
// by the form factor between the two, F = (r/h)² = 0.44 right below the ball and 0.1 on average.
TEST_P(ClosedSky, FurnaceStaysEven) {
  constexpr float radiance = 0.5f;
  ClosedScene scene;
  scene.albedo = 1;
  scene.sky = radiance;
  scene.radiance = [](const Eigen::Vector3f&) { return radiance; };
  scene.exhibit.objects = {sphere_object(0.1f, {0, 0, 0.15f}, 1)};
  for (const int bounces : {2, 3}) {
    SCOPED_TRACE(bounces);
    const relight::RelitPicture picture = relit(scene, careful_plan(32, bounces));
    Spread object, floor;
    for (int v = 0; v < scene.height; ++v) {
      for (int u = 0; u < scene.width; ++u) {
        const float covered = picture.maps->mask.at(u, v);
        if (covered == 1) object.add(picture_radiance(picture, u, v) / radiance - 1);
        if (covered == 0) floor.add(picture.maps->delta.at(u, v) / radiance);
      }
    }
    EXPECT_GT(object.count, 150);
    EXPECT_LT(object.max, bounces == 2 ? 0.05 : 0.015);  // a pixel value is 0.9 % here
    EXPECT_LT(std::abs(object.mean()), 0.01);
    EXPECT_LT(floor.max, bounces == 2 ? 0.001 : 0.06);
    EXPECT_LT(std::abs(floor.mean()), 0.002);
  }
}

// A black ball occludes its form factor of the sky from the floor: E = π L F with F = cos θ (r/d)², while it lies above
// the floor's horizon (Nusselt 1928: the cap's projection on the unit circle). Nothing else changes.
TEST_P(ClosedSky, BlackBallTakesItsFormFactor) {
  constexpr float albedo = 0.5f, sky = 1.0f, radius = 0.1f, height = 0.15f;
  ClosedScene scene;
  scene.albedo = albedo;
  scene.sky = sky;
  scene.radiance = [](const Eigen::Vector3f&) { return albedo * sky; };
  scene.exhibit.objects = {sphere_object(radius, {0, 0, height}, 0)};
  for (const int volume : {32, 64}) {
    SCOPED_TRACE(volume);
    const relight::RelitPicture picture = relit(scene, careful_plan(volume, 2));
    Spread relative, absolute;
    for (int v = 0; v < scene.height; ++v) {
      for (int u = 0; u < scene.width; ++u) {
        const float covered = picture.maps->mask.at(u, v);
        if (covered == 1) {
          EXPECT_EQ(picture.srgb.at(u, v, 0), 0);
        }
        if (covered > 0) continue;
        const float d = (scene.on_plane(u, v) - Eigen::Vector3f(0, 0, height)).norm();
        const double want = -albedo * sky * height / d * (radius / d) * (radius / d);
        const double got = picture.maps->delta.at(u, v);
        absolute.add(got - want);
        // Changes below a pixel value, 0.004 at this radiance, are faded out intentionally.
        if (want < -0.01) relative.add(got / want - 1);
      }
    }
    EXPECT_GT(relative.count, 800);

    EXPECT_LT(std::abs(relative.mean()), 0.01);
    EXPECT_LT(relative.max, 0.06);  // right below the ball, where the occluded part of the sky is wide
    EXPECT_LT(absolute.max, 0.015);
  }
}

/// Form factor from a point to a rectangle parallel to its surface at a height, one corner right above it (Howell,
/// Siegel & Mengüç 2010, B-3). Odd in both edges, so that four terms give any rectangle.
float corner_form_factor(float x_m, float y_m, float height_m) {
  const float x = x_m / height_m, y = y_m / height_m, kx = std::sqrt(1 + x * x), ky = std::sqrt(1 + y * y);
  return (x / kx * std::atan(y / kx) + y / ky * std::atan(x / ky)) / (2 * std::numbers::pi_v<float>);
}

// A sheet a ninth of a voxel thick occludes what it covers at every cone width, except for cones that start under its
// edge.
TEST_P(ClosedSky, ThinBlackSheetTakesItsFormFactor) {
  constexpr float albedo = 0.5f, sky = 1.0f, half_m = 0.16f, height_m = 0.22f;
  ClosedScene scene;
  scene.albedo = albedo;
  scene.sky = sky;
  scene.radiance = [](const Eigen::Vector3f&) { return albedo * sky; };
  scene.exhibit.objects = {box_object({-half_m, -half_m, height_m}, {half_m, half_m, height_m + 6e-4f}, 0)};
  scene.eye_m = {0, -0.8f, 0.2f};
  scene.look_at_m = {0, 0, 0.03f};
  for (const int scale : {1, 2, 4}) {
    SCOPED_TRACE(scale);
    relight::Plan plan = careful_plan(64, 1);
    plan.trace_scale = scale;
    const relight::RelitPicture picture = relit(scene, plan);
    Spread relative;
    for (int v = 0; v < scene.height; ++v) {
      for (int u = 0; u < scene.width; ++u) {
        if (picture.maps->mask.at(u, v) > 0 || picture.maps->depth_m.at(u, v) <= 0) continue;
        const Eigen::Vector3f p = scene.on_plane(u, v);
        if (p.head<2>().cwiseAbs().maxCoeff() > 2 * half_m) continue;
        const auto strip = [&](float y) {
          return corner_form_factor(half_m - p.x(), y, height_m) + corner_form_factor(half_m + p.x(), y, height_m);
        };
        const float want = -albedo * sky * (strip(half_m - p.y()) + strip(half_m + p.y()));
        relative.add(picture.maps->delta.at(u, v) / want - 1);
      }
    }
    EXPECT_GT(relative.count, 300);
    EXPECT_LT(std::abs(relative.mean()), scale == 4 ? 0.11 : 0.06);
    RecordProperty("mean at 1/" + std::to_string(scale), std::to_string(relative.mean()));
    RecordProperty("max at 1/" + std::to_string(scale), std::to_string(relative.max));
  }
}

}  // namespace
}  // namespace lumigraft::test
