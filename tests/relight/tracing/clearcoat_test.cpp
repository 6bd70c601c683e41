// The coat of KHR_materials_clearcoat, against its equation and sums over all directions.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "relight/tracing/bsdf.h"
#include "tests/relight/tracing/sampled_lobe.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

struct Direction {
  Vector3f w;
  double solid_angle_sr = 0;
};

/// The upper hemisphere in equal parts.
std::vector<Direction> hemisphere_in_parts(int steps) {
  std::vector<Direction> all;
  for (int i = 0; i < steps; ++i) {
    const float z = (static_cast<float>(i) + 0.5f) / static_cast<float>(steps), s = std::sqrt(1 - z * z);
    for (int k = 0; k < steps; ++k) {
      const float phi = 2 * kPi * (static_cast<float>(k) + 0.5f) / static_cast<float>(steps);
      all.push_back({{s * std::cos(phi), s * std::sin(phi), z}, 2 * std::numbers::pi / (steps * steps)});
    }
  }
  return all;
}

/// Schlick's reflectance of the index 1.5.
double fresnel_at(double cosine) { return 0.04 + 0.96 * std::pow(1 - cosine, 5); }

BsdfParams coated(const Material& base, float intensity, float roughness) {
  Material material = base;
  material.clearcoat = intensity;
  material.clearcoat_roughness = roughness;
  return bsdf_params_of(material.base_color.array(), material);
}

Material white_matt() { return {.base_color = {1, 1, 1}, .specular = 0, .gltf = true}; }

Vector3f at_cosine(float cosine) { return {std::sqrt(1 - cosine * cosine), 0, cosine}; }

/// Reflectance of light from all sides, by the material's own samples.
double sampled_albedo(const BsdfParams& bsdf, const Vector3f& v, int count) {
  double sum = 0;
  for (int i = 0; i < count; ++i) {
    Sampler sampler(5, 0, static_cast<std::uint32_t>(i));
    const Vector3f w = sample_direction(bsdf, v, sampler);
    if (w.z() > 0) sum += static_cast<double>(reflected(bsdf, v, w)[0] * w.z() / direction_pdf(bsdf, v, w)) / count;
  }
  return sum;
}

// What a smooth coat reflects is what it takes from a white surface below.
TEST(Clearcoat, AWhiteSurfaceInAFurnaceStaysWhite) {
  for (const float cosine : {1.0f, 0.6f, 0.3f, 0.1f})
    EXPECT_NEAR(sampled_albedo(coated(white_matt(), 1, 0), at_cosine(cosine), 1 << 14), 1, 0.01) << cosine;
}

// f = (1 - s) f_base + s f_coat: of a black and a white base the sums over all directions are s A and 1 - s + s A, with
// the albedo A of the lobe alone.
TEST(Clearcoat, ReflectsItsShareAndLeavesTheRest) {
  for (const float intensity : {1.0f, 0.5f}) {
    for (const float cosine : {0.9f, 0.3f}) {
      const Vector3f v = at_cosine(cosine);
      Material black = white_matt();
      black.base_color.setZero();
      const BsdfParams metal = bsdf_params_of(Rgb::Zero(), Rgb::Ones(), 0.25f);
      BsdfParams lobe = metal;
      lobe.f0.setOnes();
      lobe.f90 = 1;
      const double share = intensity * fresnel_at(cosine), of_lobe = sampled_albedo(lobe, v, 1 << 15);
      EXPECT_NEAR(sampled_albedo(coated(black, intensity, 0.5f), v, 1 << 15), share * of_lobe, 0.002 + 0.01 * share);
      EXPECT_NEAR(sampled_albedo(coated(white_matt(), intensity, 0.5f), v, 1 << 15), 1 - share + share * of_lobe,
                  0.005);
    }
  }
}

// v and w at 45° on either side of the normal: the halfway vector is the normal.
TEST(Clearcoat, ByHand) {
  Material plastic{.base_color = {0.5f, 0.3f, 0.1f}, .roughness = 1, .specular = 0, .gltf = true};
  const float s = std::sqrt(0.5f);
  const double a2 = std::pow(0.4, 4), lambda = 0.5 * (std::sqrt(1 + a2) - 1);
  const double lobe = 1 / (std::numbers::pi * a2) / (1 + 2 * lambda) / (4 * 0.5), share = 0.7 * fresnel_at(s);
  const Rgb value = reflected(coated(plastic, 0.7f, 0.4f), {s, 0, s}, {-s, 0, s});
  EXPECT_NEAR(value[0], (1 - share) * 0.5 / std::numbers::pi + share * lobe, 1e-4 * lobe);
  EXPECT_NEAR(value[2], (1 - share) * 0.1 / std::numbers::pi + share * lobe, 1e-4 * lobe);
}

// With a coat whose normal is not that of the base, over plastic.
TEST(Clearcoat, SamplesHaveTheDensityTheyClaim) {
  BsdfParams bsdf = coated({.base_color = {0.5f, 0.3f, 0.1f}, .roughness = 0.6f, .gltf = true}, 1, 0.4f);
  bsdf.coat_normal = Vector3f(0.25f, -0.2f, 1).normalized();
  const Vector3f v = Vector3f(-0.3f, 0.5f, 0.6f).normalized();
  double albedo = 0, moment = 0, density = 0;
  for (const auto& [w, sr] : hemisphere_in_parts(800)) {
    const double brought = static_cast<double>(reflected(bsdf, v, w)[0] * w.z()) * sr;
    albedo += brought;
    moment += brought * static_cast<double>(w.x());
    density += static_cast<double>(direction_pdf(bsdf, v, w)) * sr;
  }
  const auto sampled = test::sampled_lobe(bsdf, v, 0, 1 << 17, [](const Vector3f& w) { return w.x(); });
  EXPECT_NEAR(density, sampled.above, 0.005);
  EXPECT_NEAR(sampled.albedo, albedo, 0.003 * albedo);
  EXPECT_NEAR(sampled.moment, moment, 0.003 * albedo);
}

// Of the coat alone, the lobe and what is under it, in the terms that gathering and volumes use.
TEST(Clearcoat, MeansOverAllDirections) {
  double mean = 0;
  for (int i = 0; i < 1000; ++i) mean += 0.8 * fresnel_at((i + 0.5) / 1000) * 2 * (i + 0.5) / 1000 / 1000;
  EXPECT_NEAR(coat_share_evenly(0.8f), mean, 1e-4);
  EXPECT_NEAR(coat_share(0.8f, 0.3f), 0.8 * fresnel_at(0.3), 1e-6);
  EXPECT_NEAR(reflectance_evenly(coated(white_matt(), 0.8f, 0))[0], 1, 1e-6);
  Material black = white_matt();
  black.base_color.setZero();
  EXPECT_NEAR(reflectance_evenly(coated(black, 0.8f, 0))[0], mean, 1e-4);
  EXPECT_NEAR(reflectance_ahead(coated(black, 0.8f, 0))[0], 0.8 * 0.04, 1e-6);
  EXPECT_TRUE(coated(black, 0.8f, 0).mirrors());
  EXPECT_FALSE(coated(black, 0, 0).mirrors());
}

}  // namespace
}  // namespace lumigraft::relight
