// Parts of the reference path tracer: random numbers, materials, lamps, sky.
#include <array>
#include <vector>

#include "relight/tracing/bsdf.h"
#include "relight/tracing/meshes.h"
#include "relight/tracing/sky.h"
#include "tests/relight/reference/reference_rooms.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector3f;

/// Uniform over the upper hemisphere.
std::vector<Vector3f> hemisphere(int steps) {
  std::vector<Vector3f> directions;
  for (int i = 0; i < steps; ++i) {
    const float z = (static_cast<float>(i) + 0.5f) / static_cast<float>(steps), s = std::sqrt(1 - z * z);
    for (int k = 0; k < 4 * steps; ++k) {
      const float phi = 2 * relight::kPi * (static_cast<float>(k) + 0.5f) / static_cast<float>(4 * steps);
      directions.emplace_back(s * std::cos(phi), s * std::sin(phi), z);
    }
  }
  return directions;
}

TEST(ReferenceSampler, FillsEverySquareOnceAndDrawsAreIndependent) {
  std::array<int, 64> first{};
  double product = 0;
  for (std::uint32_t i = 0; i < 64; ++i) {
    relight::Sampler sampler(1, 7, i);
    const Eigen::Vector2f a = sampler.two(), b = sampler.two();
    ++first[static_cast<std::size_t>(static_cast<int>(8 * a.x()) + 8 * static_cast<int>(8 * a.y()))];
    product += (a.x() - 0.5) * (b.x() - 0.5);
  }
  for (const int count : first) EXPECT_EQ(count, 1);
  EXPECT_LT(std::abs(product / 64), 4.0 / 12 / 8);
}

TEST(ReferenceBsdf, DensitiesSumToTheFractionOfSamplesAboveTheSurface) {
  const Vector3f v = Vector3f(0.6f, 0.2f, 0.7f).normalized();
  const std::vector<Vector3f> directions = hemisphere(300);
  const float dw = 2 * relight::kPi / static_cast<float>(directions.size());
  for (const float roughness : {0.35f, 0.6f, 1.0f}) {
    SCOPED_TRACE(roughness);
    const relight::BsdfParams bsdf = relight::bsdf_params_of(relight::Rgb::Ones(), metal(1, roughness));
    double pdf = 0, albedo = 0, above = 0;
    for (const Vector3f& w : directions) {
      pdf += relight::direction_pdf(bsdf, v, w) * dw;
      albedo += relight::reflected(bsdf, v, w)[0] * w.z() * dw;
    }
    constexpr int kCount = 1 << 14;
    for (std::uint32_t i = 0; i < kCount; ++i) {
      relight::Sampler sampler(0, 0, i);
      above += relight::sample_direction(bsdf, v, sampler).z() > 0 ? 1.0 / kCount : 0;
    }
    EXPECT_NEAR(pdf, above, 0.005);
    // A metal without absorption loses the light that would be reflected several times between microfacets.
    EXPECT_LT(albedo, pdf);
    EXPECT_GT(albedo, roughness < 0.5f ? 0.97 : 0.3);
  }
}

TEST(ReferenceBsdf, SamplesHaveTheDensityTheyClaim) {
  const Vector3f v = Vector3f(-0.3f, 0.5f, 0.6f).normalized();
  const relight::Material glossy{{0.5f, 0.3f, 0.1f}, 0, 0.6f, 1};
  const relight::BsdfParams bsdf = relight::bsdf_params_of(relight::Rgb(0.5f, 0.3f, 0.1f), glossy);
  const std::vector<Vector3f> directions = hemisphere(200);
  double albedo = 0, first_moment = 0;
  for (const Vector3f& w : directions) {
    const double brought =
        relight::reflected(bsdf, v, w)[0] * w.z() * 2 * relight::kPi / static_cast<double>(directions.size());
    albedo += brought;
    first_moment += brought * w.x();
  }
  double sampled = 0, sampled_moment = 0;
  constexpr int kCount = 1 << 17;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    relight::Sampler sampler(0, 0, i);
    const Vector3f w = relight::sample_direction(bsdf, v, sampler);
    if (w.z() <= 0) continue;
    const double brought = relight::reflected(bsdf, v, w)[0] * w.z() / relight::direction_pdf(bsdf, v, w) / kCount;
    sampled += brought;
    sampled_moment += brought * w.x();
  }
  EXPECT_NEAR(sampled, albedo, 0.003 * albedo);
  EXPECT_NEAR(sampled_moment, first_moment, 0.003 * albedo);
}

TEST(ReferenceBsdf, ByHand) {
  // Roughness 0.5, v and w at 45° on either side, h = n: the mirror part of brdf.glsl, and light through the surface
  // twice.
  const relight::Material plastic{{0.5f, 0.3f, 0.1f}, 0, 0.5f, 0.8f};
  const relight::BsdfParams bsdf = relight::bsdf_params_of(relight::Rgb(0.5f, 0.3f, 0.1f), plastic);
  const float s = std::sqrt(0.5f), a2 = 0.0625f;
  const float lambda = 0.5f * (std::sqrt(1 + a2) - 1), d = 1 / (relight::kPi * a2);
  const float f = 0.032f + (0.8f - 0.032f) * std::pow(1 - s, 5.0f), mirror = f * d / (1 + 2 * lambda) / (4 * s * s);
  const relight::Rgb value = relight::reflected(bsdf, {s, 0, s}, {-s, 0, s});
  EXPECT_NEAR(value[0], 0.5f * (1 - f) * (1 - f) / relight::kPi + mirror, 1e-5f);
  EXPECT_NEAR(value[2], 0.1f * (1 - f) * (1 - f) / relight::kPi + mirror, 1e-5f);

  // Mixed as in glTF, the halfway vector alone counts.
  relight::Material gltf = plastic;
  gltf.gltf = true;
  const relight::Rgb mixed =
      relight::reflected(relight::bsdf_params_of(relight::Rgb(0.5f, 0.3f, 0.1f), gltf), {s, 0, s}, {-s, 0, s});
  EXPECT_NEAR(mixed[0], 0.5f * (1 - f) / relight::kPi + mirror, 1e-5f);
  const Vector3f v = Vector3f(0.9f, 0, 0.3f).normalized(), w = Vector3f(0.2f, -0.7f, 0.6f).normalized();
  const relight::BsdfParams body{.diffuse = {0.6f, 0.6f, 0.6f}, .f0 = {0.04f, 0.04f, 0.04f}, .f90 = 1, .gltf = true};
  const relight::BsdfParams black{.f0 = {0.04f, 0.04f, 0.04f}, .f90 = 1, .gltf = true};
  const float half = v.dot((v + w).normalized());
  EXPECT_NEAR((relight::reflected(body, v, w) - relight::reflected(black, v, w))[0],
              0.6f / relight::kPi * 0.96f * (1 - std::pow(1 - half, 5.0f)), 1e-5f);
}

// Of uniform light, against the sum over all directions. Without the layer's reflection.
TEST(ReferenceBsdf, TheMeanUnderALayer) {
  const std::vector<Vector3f> directions = hemisphere(300);
  const float dw = 2 * relight::kPi / static_cast<float>(directions.size());
  for (const bool gltf : {false, true}) {
    const relight::BsdfParams body{
        .diffuse = relight::Rgb::Ones(), .f0 = {0.04f, 0.2f, 0.5f}, .f90 = 1, .alpha = 0.3f, .gltf = gltf};
    double over_all_angles = 0, bodies = 0;
    for (const float cosine : {1.0f, 0.7f, 0.4f, 0.2f, 0.1f}) {
      const Vector3f v(std::sqrt(1 - cosine * cosine), 0, cosine);
      relight::Rgb mean = relight::Rgb::Zero();
      for (const Vector3f& w : directions) {
        mean += relight::under_layer(body, w.z(), cosine, v.dot((v + w).normalized())) * w.z() * dw / relight::kPi;
      }
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(relight::under_layer_evenly(body, cosine)[c], mean[c], 0.002) << gltf << ' ' << cosine << ' ' << c;
    }
    for (int i = 0; i < 200; ++i) {
      const float cosine = (static_cast<float>(i) + 0.5f) / 200;
      over_all_angles += relight::under_layer_evenly(body, cosine)[0] * 2 * cosine / 200;
    }
    relight::BsdfParams black = body;
    black.diffuse.setZero();
    bodies = (relight::reflectance_evenly(body) - relight::reflectance_evenly(black))[0];
    EXPECT_NEAR(bodies, over_all_angles, 0.002) << gltf;
  }
}

TEST(ReferenceSky, SamplesThePictureByItsLight) {
  relight::ReferenceScene scene;
  scene.environment.radiance = capture::Image<float>(24, 12, 3, 0.1f);
  scene.environment.radiance.at(20, 3, 0) = 40;
  scene.environment.radiance.at(5, 10, 1) = 9;
  const relight::Sky sky(scene);
  // Irradiance of a plane facing +z, by importance sampling of the image and by uniform sampling of the hemisphere.
  relight::Rgb even = relight::Rgb::Zero(), chosen = relight::Rgb::Zero();
  const std::vector<Vector3f> directions = hemisphere(300);
  for (const Vector3f& w : directions)
    even += sky.radiance(w) * (w.z() * 2 * relight::kPi / static_cast<float>(directions.size()));
  constexpr int kCount = 1 << 14;
  for (std::uint32_t i = 0; i < kCount; ++i) {
    relight::Sampler sampler(0, 0, i);
    const relight::LightSample s = sky.sample(sampler.two());
    ASSERT_NEAR(s.pdf, sky.pdf(s.w), 1e-3f * s.pdf + 1e-6f) << i;
    chosen += s.radiance * (std::max(s.w.z(), 0.0f) / s.pdf / kCount);
  }
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(chosen[c], even[c], 0.01f * even[c]);
}

TEST(ReferenceSky, ABlackPictureHasNothingToSample) {
  relight::ReferenceScene scene;
  scene.environment.radiance = capture::Image<float>(16, 8, 3, 0.0f);
  const relight::Sky sky(scene);
  relight::Sampler sampler(1, 1, 1);
  const relight::LightSample s = sky.sample(sampler.two());
  EXPECT_EQ(s.pdf, 0);
  EXPECT_TRUE(s.w.allFinite() && s.radiance.allFinite());
  EXPECT_EQ(sky.pdf(Vector3f::UnitZ()), 0);
}

TEST(ReferenceMeshes, TexturesColoursAndSmoothNormals) {
  Points corners;
  add_quad(&corners, {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0});
  auto texture = std::make_shared<capture::Image<std::uint8_t>>(2, 1, 3, std::uint8_t{0});
  for (int c = 0; c < 3; ++c) texture->at(1, 0, c) = 255;
  relight::Model model;
  add_part(&model, corners, lambert(0.5f), texture, {{0, 0}, {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}});
  model.colors.assign(model.colors.size(), Vector3f(1, 0.5f, 0.25f));
  relight::ReferenceMesh mesh;
  mesh.model = std::make_shared<const relight::Model>(model);
  mesh.T_tag_model = Eigen::Translation3f(0, 0, 2) * Eigen::AngleAxisf(relight::kPi / 2, Vector3f::UnitX());
  const relight::Meshes meshes({mesh}, nullptr);
  // The quad is now in the plane y = 0, its own z axis towards -y.
  const auto hit_at = [&](float x, float from_y) {
    const Vector3f w(0, from_y > 0 ? -1 : 1, 0);
    const auto hit = meshes.hit({x, from_y, 2.5f}, w, 10);
    EXPECT_TRUE(hit.has_value());
    return meshes.surface(*hit, w);
  };
  const relight::SurfaceHit light = hit_at(0.75f, -3), dark = hit_at(0.25f, -3);
  EXPECT_NEAR(light.bsdf.diffuse[0], 0.5f, 1e-3f);
  EXPECT_NEAR(light.bsdf.diffuse[2], 0.125f, 1e-3f);
  EXPECT_NEAR(dark.bsdf.diffuse[0], 0, 1e-3f);
  EXPECT_NEAR(light.normal.y(), -1, 1e-5f);
  EXPECT_NEAR(hit_at(0.75f, 3).normal.y(), 1, 1e-5f) << "seen from behind";
  EXPECT_TRUE(meshes.blocked({0.5f, -1, 2.5f}, {0, 1, 0}, 1.5f));
  EXPECT_FALSE(meshes.blocked({0.5f, -1, 2.5f}, {0, 1, 0}, 0.5f));
}

// A ray that represents a solid angle makes what it hits rougher: by the lobe's width, and by the curvature within.
TEST(ReferenceMeshes, WithinASolidAngleSurfacesAreRougher) {
  const auto alpha = [](float radius_m, float solid_angle_sr) {
    relight::ReferenceMesh ball;
    auto model = std::make_shared<relight::Model>(model_of(sphere(radius_m, 60)));
    for (std::size_t i = 0; i < model->normals.size(); ++i) model->normals[i] = model->positions_m[i].normalized();
    model->parts[0].material = metal(1, 0.2f);
    ball.model = model;
    const relight::Meshes meshes({ball}, nullptr);
    const Vector3f w(0, 0.99f, std::sqrt(1 - 0.99f * 0.99f));
    const auto hit = meshes.hit(-(radius_m + 0.5f) * w, w, 10);
    return meshes.surface_within(*hit, w, solid_angle_sr).bsdf.alpha;
  };
  EXPECT_NEAR(alpha(0.1f, 0), 0.04f, 1e-6);
  const float large = alpha(1000, 0.05f);
  EXPECT_NEAR(large, std::sqrt(0.05f / (4 * relight::kPi)), 0.01f) << "nearly flat: the lobe's width";
  // α² grows by twice the normals' variance: a twelfth of the square of footprint over radius.
  const float footprint_m = 0.5f * std::sqrt(0.001f), radius_m = 0.05f;
  EXPECT_NEAR(alpha(radius_m, 0.001f), std::sqrt(0.0016f + 2 * std::pow(footprint_m / radius_m, 2.0f) / 12), 0.01f);
  EXPECT_EQ(alpha(0.001f, 1), 1);
}

TEST(ReferenceMeshes, WhatACameraSeesCountsBeforeColours) {
  relight::ReferenceMesh floor = square(1, 0, lambert(0.5f));
  floor.seen = true;
  const relight::PosedCamera camera = looking({0, -1, 1}, {0, 0, 0}, 0.5f, 32, 24);
  relight::SeenMaterials seen{camera.model,
                              camera.T_tag_camera.inverse(),
                              capture::Image<float>(32, 24, 1),
                              capture::Image<float>(32, 24, 3, 0.2f),
                              capture::Image<float>(32, 24, 3, 0.0f),
                              capture::Image<float>(32, 24, 1, 1.0f)};
  for (int v = 0; v < 24; ++v) {
    for (int u = 0; u < 32; ++u) {
      const Vector3f w = camera.T_tag_camera.linear() * camera.model.unproject({u, v})->cast<float>();
      const float t = -1 / w.z();
      seen.depth_m.at(u, v) = (camera.T_tag_camera.inverse() * Vector3f(Vector3f(0, -1, 1) + t * w)).z();
      if (u < 16) seen.depth_m.at(u, v) *= 0.9f;  // occluded by another surface
    }
  }
  const relight::Meshes meshes({floor}, &seen);
  const auto diffuse_at = [&](float x) {
    return meshes.surface(*meshes.hit({x, 0, 1}, {0, 0, -1}, 10), {0, 0, -1}).bsdf.diffuse[0];
  };
  EXPECT_FLOAT_EQ(diffuse_at(0.1f), 0.2f);
  EXPECT_FLOAT_EQ(diffuse_at(-0.1f), 0.5f);
  EXPECT_FLOAT_EQ(diffuse_at(0.9f), 0.5f) << "out of view";
}

}  // namespace
}  // namespace lumigraft::test
