// Anisotropic microfacets (KHR_materials_anisotropy), against their definition and sums over all directions.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "relight/tracing/bsdf.h"
#include "relight/tracing/vertex.h"
#include "tests/relight/tracing/sampled_lobe.h"

namespace lumigraft::relight {
namespace {

using Eigen::Array2f;
using Eigen::Vector3f;

/// Integral over the hemisphere.
template <typename Value>
double over_directions(int steps, Value value) {
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    const double z = (i + 0.5) / steps, s = std::sqrt(1 - z * z);
    for (int k = 0; k < steps; ++k) {
      const double phi = 2 * std::numbers::pi * (k + 0.5) / steps;
      const Vector3f w(static_cast<float>(s * std::cos(phi)), static_cast<float>(s * std::sin(phi)),
                       static_cast<float>(z));
      sum += static_cast<double>(value(w)) * 2 * std::numbers::pi / (steps * steps);
    }
  }
  return sum;
}

Material brushed(float roughness, float strength) {
  Material material{.base_color = {1, 1, 1}, .metallic = 1, .roughness = roughness, .gltf = true};
  material.anisotropy = strength;
  return material;
}

BsdfParams bsdf_of_metal(float roughness, float strength) {
  return bsdf_params_of(Rgb::Ones(), brushed(roughness, strength));
}

// α along the direction is that across it, mixed with 1 by the square of the strength.
TEST(Anisotropy, RoughnessOfTheExtension) {
  const BsdfParams bsdf = bsdf_of_metal(0.5f, 0.6f);
  EXPECT_NEAR(bsdf.alphas().x(), 0.25 + 0.75 * 0.36, 1e-6);
  EXPECT_NEAR(bsdf.alphas().y(), 0.25, 1e-6);
  EXPECT_EQ(bsdf_of_metal(0.5f, 0).alphas().x(), bsdf_of_metal(0.5f, 0).alphas().y());
}

// The projected area of all microfacets is that of the surface, and those that v sees have together the density 1.
TEST(Anisotropy, MicrofacetsCoverTheSurface) {
  const Array2f alpha(0.6f, 0.2f);
  EXPECT_NEAR(over_directions(600, [&](const Vector3f& h) { return normals_density(alpha, h) * h.z(); }), 1, 0.003);
  for (const Vector3f& v : {Vector3f(0.8f, 0, 0.6f), Vector3f(0, 0.8f, 0.6f), Vector3f(0.5f, -0.5f, 0.2f).normalized()})
    EXPECT_NEAR(over_directions(600, [&](const Vector3f& h) { return visible_normals_density(alpha, v, h); }), 1,
                0.005);
}

// Slopes are those of an isotropic surface, stretched: equal where the stretched vectors are.
TEST(Anisotropy, IsAStretchedIsotropicSurface) {
  const Vector3f v = Vector3f(0.3f, 0.6f, 0.5f).normalized();
  const Vector3f stretched = Vector3f(2 * v.x(), 0.5f * v.y(), v.z()).normalized();
  EXPECT_NEAR(smith_lambda({0.6f, 0.15f}, v), smith_lambda({0.3f, 0.3f}, stretched), 1e-5);
  // At the normal: 1 / (π αx αy).
  EXPECT_NEAR(normals_density({0.6f, 0.15f}, Vector3f::UnitZ()), 1 / (std::numbers::pi * 0.6 * 0.15), 1e-4);
}

TEST(Anisotropy, SamplesHaveTheDensityTheyClaim) {
  const BsdfParams bsdf = bsdf_of_metal(0.5f, 0.8f);
  const Vector3f v = Vector3f(-0.3f, 0.5f, 0.6f).normalized();
  const double density = over_directions(800, [&](const Vector3f&w) { return direction_pdf(bsdf, v, w); }),
               albedo = over_directions(800, [&](const Vector3f&w) { return reflected(bsdf, v, w)[0] * w.z(); }),
               spread_x = over_directions(
                   800, [&](const Vector3f&w) { return reflected(bsdf, v, w)[0] * w.z() * w.x() * w.x(); });
  const auto sampled = test::sampled_lobe(bsdf, v, 1, 1 << 16, [](const Vector3f& w) { return w.x() * w.x(); });
  EXPECT_NEAR(density, sampled.above, 0.005);
  EXPECT_NEAR(sampled.albedo, albedo, 0.005);
  EXPECT_NEAR(sampled.moment, spread_x, 0.005);
  EXPECT_LE(albedo, 1);
}

// On a surface that lies obliquely, the lobe is wide along the direction that the surface names.
TEST(Anisotropy, FollowsTheSurface) {
  SurfaceHit surface;
  surface.face = surface.normal = Vector3f(0.2f, -0.5f, 0.8f).normalized();
  surface.bsdf = bsdf_of_metal(0.4f, 1);
  const Vector3f along = surface.normal.cross(Vector3f(0.4f, 0.3f, 0.1f)).normalized(),
                 across = surface.normal.cross(along);
  surface.bsdf.along = 3 * along + 0.7f * surface.normal;  // neither unit nor in the surface
  const PathVertex vertex(surface, -surface.normal);
  const auto response = [&](const Vector3f& to) {
    return vertex.response((surface.normal + 0.5f * to).normalized())[0];
  };
  EXPECT_GT(response(along), 3 * response(across));
  EXPECT_NEAR(response(along), response(-along), 1e-4f * response(along));
  EXPECT_NEAR(response(across), response(-across), 1e-4f * response(along));
}

}  // namespace
}  // namespace lumigraft::relight
