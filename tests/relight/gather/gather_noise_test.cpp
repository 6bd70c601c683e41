// Noise of gathered light against renderings of the same scene with many rays.
#include <cmath>
#include <cstdio>

#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"
#include "tests/relight/exhibit/model_files.h"

namespace lumigraft::test {
namespace {

relight::RelitPicture with_rays(const ClosedScene& scene, const capture::Session& session, int trace_scale, int rays) {
  relight::RayRenderer renderer(session);
  return scene.relit(renderer, rays_plan(trace_scale, rays, 1));
}

/// RMS of the difference of values that are chosen by `of(picture, u, v)`, which gives nothing where they don't count.
template <typename Of>
double noise(const relight::RelitPicture& few, const relight::RelitPicture& many, Of of) {
  double off = 0;
  int count = 0;
  for (int v = 0; v < few.srgb.height; ++v) {
    for (int u = 0; u < few.srgb.width; ++u) {
      const std::optional<float> a = of(few, u, v), b = of(many, u, v);
      if (!a || !b) continue;
      off += std::pow(*a - *b, 2);
      ++count;
    }
  }
  EXPECT_GT(count, 100);
  return std::sqrt(off / std::max(count, 1));
}

/// A coloured block on a glossy plate.
struct GlossyPlate {
  TemporaryFolder folder;
  ClosedScene scene;
  capture::RealSurface plate;

  GlossyPlate() {
    scene.width = 48;
    scene.height = 36;
    scene.focal_px = 45;
    scene.eye_m = {0, -0.5f, 0.35f};
    scene.sky = 0.5f;
    scene.radiance = [](const Eigen::Vector3f&) { return 0.4f; };
    scene.exhibit.objects = {box_object({-0.08f, -0.03f, 0}, {0.08f, 0.03f, 0.15f}, 0.05f)};
    plate.mesh = folder.write(
        "plate.ply",
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 2\nproperty list uchar int vertex_indices\nend_header\n-0.4 -0.4 0\n0.4 -0.4 0\n0.4 0.4 0\n"
        "-0.4 0.4 0\n3 0 1 2\n3 0 2 3\n");
    plate.metallic = 1;
    plate.roughness = 0.5f;
    plate.specular = 1;
    plate.base_color.setConstant(0.9f);
  }
  /// With white of the picture at this radiance.
  capture::Session session(double white) const {
    capture::Session s = scene.session();
    s.tag.size_m = 0.01;
    s.real_surfaces = {plate};
    s.color.exposure = 1 / white;
    return s;
  }
};

/// A rough metal corner, of which one side shows the lamp's highlight on the other to a few of its rays.
ClosedScene metal_corner() {
  ClosedScene scene;
  scene.width = 48;
  scene.height = 36;
  scene.focal_px = 80;
  scene.eye_m = {0, -0.5f, 0.35f};
  scene.look_at_m = {0, 0, 0.08f};
  scene.sky = 0.1f;
  scene.radiance = [](const Eigen::Vector3f&) { return 0.1f; };
  scene.lamps = {lamp_at({0.1f, -0.25f, 0.5f}, 0.02f, 0.05f)};
  const relight::Material metal{.base_color = {0.9f, 0.8f, 0.5f}, .metallic = 1, .roughness = 0.45f};
  scene.exhibit.objects = {box_object({-0.15f, 0, 0.01f}, {0.15f, 0.02f, 0.2f}, 0.9f),
                           box_object({-0.15f, -0.15f, 0.01f}, {0.15f, 0, 0.03f}, 0.9f)};
  for (relight::VirtualObject& object : scene.exhibit.objects) object.material = metal;
  return scene;
}

// Even shading has no curvature from pixel to pixel: what there is of it is noise.
TEST(RaysNoise, WhatObjectsMirrorHasMoreRaysWhereItIsNoisy) {
  const ClosedScene scene = metal_corner();
  relight::RayRenderer renderer(scene.session());
  const relight::RelitPicture picture = scene.relit(renderer, rays_plan(2));
  double squares = 0;
  int count = 0;
  for (int v = 1; v + 1 < scene.height; ++v) {
    for (int u = 2; u + 2 < scene.width; ++u) {
      bool inside = true;
      for (int x = u - 2; x <= u + 2; ++x) inside = inside && picture.maps->mask.at(x, v) == 1;
      if (!inside) continue;
      const auto code = [&](int x) { return static_cast<double>(picture.srgb.at(x, v, 0)); };
      squares += std::pow(code(u - 1) - 2 * code(u) + code(u + 1), 2) / 6;
      ++count;
    }
  }
  EXPECT_GT(count, 200);
  const double noise = std::sqrt(squares / count);
  std::printf("metal corner: noise %.2f pixel values\n", noise);
  EXPECT_LT(noise, 3);
}

// Where a step of the picture is small, up to gloss_rounds times as many rays halve the noise of glossy pixels; where
// it is large the first round is enough.
TEST(RaysNoise, GlossyPixelsAreGatheredToAStepOfThePicture) {
  const GlossyPlate of;
  const auto change = [](const relight::RelitPicture& picture, int u, int v) -> std::optional<float> {
    if (picture.maps->mask.at(u, v) > 0) return std::nullopt;
    return picture.maps->delta.at(u, v);
  };
  constexpr double kLarge = 1000, kSmall = 0.001;  // radiances of white, of 255 steps
  const relight::RelitPicture many = with_rays(of.scene, of.session(kSmall), 2, 96);
  const double one_round = noise(with_rays(of.scene, of.session(kLarge), 2, 8), many, change),
               all_rounds = noise(with_rays(of.scene, of.session(kSmall), 2, 8), many, change);
  std::printf("glossy pixels: noise %.5f after a round, %.5f after all\n", one_round, all_rounds);
  EXPECT_LT(all_rounds, 0.65 * one_round) << "1 / 2 of independent rays";
  EXPECT_GT(all_rounds, 0);
}

// A ball between a bright sky and a dark floor. N rays of a probe, a fraction p of which sees the sky, have at most the
// noise of independent ones, √((1 - p) / (p N)) of the mean; object_rays times the plan's make it less than that of as
// many as the plan has.
TEST(RaysNoise, ProbesOfObjectsHaveMoreRaysThanPixels) {
  ClosedScene scene;
  scene.width = 48;
  scene.height = 36;
  scene.focal_px = 90;
  scene.look_at_m = {0, 0, 0.15f};
  scene.albedo = 0.01f;
  scene.radiance = [](const Eigen::Vector3f&) { return 0.0f; };
  scene.exhibit.objects = {sphere_object(0.1f, {0, 0, 0.15f}, 0.8f)};
  const auto light = [](const relight::RelitPicture& picture, int u, int v) -> std::optional<float> {
    if (picture.maps->mask.at(u, v) < 1) return std::nullopt;
    return picture_radiance(picture, u, v);
  };
  const relight::RelitPicture many = with_rays(scene, scene.session(), 8, 64);
  const double few = noise(with_rays(scene, scene.session(), 8, 4), many, light);
  std::printf("probes: noise %.5f\n", few);
  EXPECT_LT(few, 0.035);  // with as many as the plan it is 0.058
}

}  // namespace
}  // namespace lumigraft::test
