// Sheen (KHR_materials_sheen), against sums over all directions and its equation.
#include "relight/exhibit/sheen.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "relight/tracing/bsdf.h"
#include "tests/relight/tracing/sampled_lobe.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

Vector3f direction_at(double cosine, double phi) {
  const double s = std::sqrt(1 - cosine * cosine);
  return Vector3f(static_cast<float>(s * std::cos(phi)), static_cast<float>(s * std::sin(phi)),
                  static_cast<float>(cosine));
}

/// Integral over the hemisphere of `value(w)` · cos, finer where w grazes the surface.
template <typename Value>
double over_hemisphere(int steps, Value value) {
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    const double s = (i + 0.5) / steps, cosine = s * s;
    for (int k = 0; k < steps; ++k) {
      const double phi = 2 * std::numbers::pi * (k + 0.5) / steps;
      sum += static_cast<double>(value(direction_at(cosine, phi))) * cosine * 2 * s * 2 * std::numbers::pi /
             (steps * steps);
    }
  }
  return sum;
}

double summed_albedo(float alpha, const Vector3f& v) {
  return over_hemisphere(400,
                         [&](const Vector3f& w) { return sheen_brdf(alpha, v.z(), w.z(), (v + w).normalized().z()); });
}

Material cloth(float base, const Vector3f& sheen, float roughness) {
  Material material{.base_color = Vector3f::Constant(base), .specular = 0, .gltf = true};
  material.sheen_color = sheen;
  material.sheen_roughness = roughness;
  return material;
}

BsdfParams bsdf_of_cloth(const Material& material) { return bsdf_params_of(material.base_color.array(), material); }

// sin θ of the halfway vector to the power 1 / α, its norm, and the fitted masking at α = 1 and a cosine of 0.5.
TEST(Sheen, ByHand) {
  const double s = std::sqrt(0.75);  // v and w at 60° on either side: h is the normal; turned by 90°: cos h = 1 / √2.5
  const Vector3f v(static_cast<float>(s), 0, 0.5f), w(0, static_cast<float>(s), 0.5f);
  const double cos_half = static_cast<double>((v + w).normalized().z()), sine = std::sqrt(1 - cos_half * cos_half);
  const double lambda = std::exp(21.5473 / (1 + 3.82987 * std::pow(0.5, 0.19823)) - 1.97760 * 0.5 - 4.32054);
  const double expected = 3 / (2 * std::numbers::pi) * sine / (1 + 2 * lambda) / (4 * 0.25);
  EXPECT_NEAR(sheen_brdf(1, 0.5f, 0.5f, static_cast<float>(cos_half)), expected, 1e-5);
}

TEST(Sheen, TablesAreTheSumsOverAllDirections) {
  for (const float roughness : {0.15f, 0.3f, 0.55f, 1.0f}) {
    const float alpha = roughness * roughness;
    double mean = 0, larger = 0;
    std::vector<double> exact;
    constexpr int kCosines = 16;
    for (int i = 0; i < kCosines; ++i) {
      const double cosine = (i + 0.5) / kCosines;
      exact.push_back(std::min(summed_albedo(alpha, direction_at(cosine, 0)), 1.0));
      EXPECT_NEAR(sheen_albedo(alpha, static_cast<float>(cosine)), exact.back(), 0.006) << roughness << ' ' << cosine;
      mean += exact.back() * 2 * cosine / kCosines;
    }
    for (int i = 0; i < kCosines; ++i) {
      double of_i = 0;
      for (int k = 0; k < kCosines; ++k)
        of_i += std::max(exact[static_cast<std::size_t>(i)], exact[static_cast<std::size_t>(k)]) * 2 * (k + 0.5) /
                (kCosines * kCosines);
      larger += of_i * 2 * (i + 0.5) / (kCosines * kCosines);
      EXPECT_NEAR(larger_sheen_albedo(alpha, static_cast<float>((i + 0.5) / kCosines)), of_i, 0.012) << roughness;
    }
    EXPECT_NEAR(sheen_albedo_evenly(alpha), mean, 0.008) << roughness;
    EXPECT_NEAR(larger_sheen_albedo_evenly(alpha), larger, 0.012) << roughness;
  }
}

// White cloth takes no energy from a furnace but what the larger of both albedos takes too much, and adds none.
TEST(Sheen, AWhiteSurfaceInAFurnace) {
  for (const float roughness : {0.3f, 0.7f}) {
    const BsdfParams bsdf = bsdf_of_cloth(cloth(1, {1, 1, 1}, roughness));
    for (const double cosine : {0.9, 0.5, 0.15}) {
      const Vector3f v = direction_at(cosine, 0.3);
      const double all = over_hemisphere(300, [&](const Vector3f& w) { return reflected(bsdf, v, w)[0]; });
      EXPECT_LT(all, 1.005) << roughness << ' ' << cosine;
      const auto c = static_cast<float>(cosine);
      EXPECT_NEAR(all, sheen_albedo(bsdf.sheen_alpha, c) + under_sheen_evenly(bsdf, c), 0.012);
    }
    EXPECT_NEAR(reflectance_evenly(bsdf)[0],
                sheen_albedo_evenly(bsdf.sheen_alpha) + 1 - larger_sheen_albedo_evenly(bsdf.sheen_alpha), 1e-5);
  }
}

TEST(Sheen, IsTheSameInBothDirections) {
  Material material = cloth(0.5f, {0.2f, 0.5f, 0.9f}, 0.4f);
  material.specular = 1;
  const BsdfParams bsdf = bsdf_of_cloth(material);
  const Vector3f v = direction_at(0.3, 0.2), w = direction_at(0.8, 2.5);
  EXPECT_LT((reflected(bsdf, v, w) - reflected(bsdf, w, v)).abs().maxCoeff(), 1e-6f);
}

// Coloured sheen under a coat, over plastic.
TEST(Sheen, SamplesHaveTheDensityTheyClaim) {
  Material material = cloth(0.4f, {0.9f, 0.5f, 0.2f}, 0.5f);
  material.specular = 1;
  material.roughness = 0.6f;
  material.clearcoat = 1;
  material.clearcoat_roughness = 0.5f;
  const BsdfParams bsdf = bsdf_of_cloth(material);
  const Vector3f v = direction_at(0.6, 1.1);
  const auto over_w = [&](auto of) {
    return over_hemisphere(500, [&](const Vector3f& w) { return of(w) / std::max(w.z(), 1e-6f); });
  };
  const double albedo = over_w([&](const Vector3f&w) { return reflected(bsdf, v, w)[0] * w.z(); }),
               density = over_w([&](const Vector3f&w) { return direction_pdf(bsdf, v, w); }),
               moment = over_w([&](const Vector3f&w) { return reflected(bsdf, v, w)[0] * w.z() * w.x(); });
  const auto sampled = test::sampled_lobe(bsdf, v, 3, 1 << 16, [](const Vector3f& w) { return w.x(); });
  EXPECT_NEAR(density, sampled.above, 0.005);
  EXPECT_NEAR(sampled.albedo, albedo, 0.005 * albedo);
  EXPECT_NEAR(sampled.moment, moment, 0.005 * albedo);
}

TEST(Sheen, WithoutColourThereIsNone) {
  const BsdfParams bsdf = bsdf_of_cloth(cloth(0.5f, {0, 0, 0}, 0.5f));
  EXPECT_FALSE(bsdf.mirrors());
  EXPECT_EQ(under_sheen(bsdf, 0.3f, 0.4f), 1);
  EXPECT_TRUE(bsdf_of_cloth(cloth(0.5f, {0, 0.1f, 0}, 0.5f)).mirrors());
}

}  // namespace
}  // namespace lumigraft::relight
