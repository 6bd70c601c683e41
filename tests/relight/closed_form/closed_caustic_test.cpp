// Light of a lamp that a polished metal plate throws on the floor: that of the lamp's mirror image.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

constexpr float kPlate_m = 0.2f, kMetal = 0.9f;  // the plane of its front, y; its reflectance

/// An upright plate and a lamp in front of it.
ClosedScene floor_before_plate() {
  ClosedScene scene;
  scene.width = 48;
  scene.height = 36;
  scene.focal_px = 60;
  scene.look_at_m = {0, -0.1f, 0};
  scene.sky = 0;
  scene.lamps = {lamp_at({0, -0.5f, 0.5f}, 0.01f, 0.3f)};
  scene.radiance = [lamp = scene.lamps[0], albedo = scene.albedo](const Eigen::Vector3f& p) {
    return albedo / std::numbers::pi_v<float> * irradiance(lamp, {p.x(), p.y(), 0}, Eigen::Vector3f::UnitZ());
  };
  scene.exhibit.objects = {box_object({-0.15f, kPlate_m, 0.001f}, {0.15f, kPlate_m + 0.01f, 0.3f}, 0)};
  scene.exhibit.objects[0].material =
      relight::Material{.base_color = Eigen::Vector3f::Constant(kMetal), .metallic = 1, .roughness = 0.1f};
  return scene;
}

// Where the floor sees the lamp's image well within the plate. Rays alone, which find it by a lobe as wide as they lie
// apart, spread this light beyond.
TEST(RaysCaustic, APlateLightsTheFloorAsTheMirrorImageOfTheLamp) {
  const ClosedScene scene = floor_before_plate();
  reconstruct::PointLight image = scene.lamps[0];
  image.position_m.y() = 2 * kPlate_m - image.position_m.y();
  for (const int trace_scale : {2, 8}) {
    relight::RayRenderer renderer(scene.session());
    const relight::RelitPicture picture = scene.relit(renderer, rays_plan(trace_scale, 20, 1));
    double off = 0, all = 0, sum = 0, expected_sum = 0;
    for (int v = 0; v < scene.height; ++v) {
      for (int u = 0; u < scene.width; ++u) {
        const Eigen::Vector3f p = scene.on_plane(u, v);
        if (picture.maps->mask.at(u, v) > 0 || std::abs(p.x()) > 0.12f || std::abs(p.y() + 0.1f) > 0.2f) continue;
        const double expected = kMetal * scene.albedo / std::numbers::pi *
                                static_cast<double>(irradiance(image, {p.x(), p.y(), 0}, Eigen::Vector3f::UnitZ()));
        const double found = static_cast<double>(picture.maps->delta.at(u, v));
        off += std::pow(found - expected, 2);
        all += expected * expected;
        sum += found;
        expected_sum += expected;
      }
    }
    std::printf("caustic, 1/%d: off by %.3f, mean %.3f\n", trace_scale, std::sqrt(off / all), sum / expected_sum);
    EXPECT_NEAR(sum / expected_sum, 1, 0.06) << trace_scale;
    EXPECT_LT(std::sqrt(off / all), 0.25) << trace_scale;  // photons' noise is 16 %
  }
}

}  // namespace
}  // namespace lumigraft::test
