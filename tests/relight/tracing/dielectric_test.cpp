// Interfaces of transmissive materials against Fresnel, Snell and the conservation of energy.
#include "relight/tracing/dielectric.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "relight/tracing/bsdf.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector3f;

relight::Material glass_of(float roughness, float ior = 1.5f, bool thin_walled = false) {
  relight::Material material{.base_color = {1, 1, 1}, .roughness = roughness, .gltf = true};
  material.transmission = 1;
  material.ior = ior;
  material.thin_walled = thin_walled;
  return material;
}

relight::BsdfParams bsdf_of(const relight::Material& material, bool front) {
  return relight::bsdf_params_of(material.base_color.array(), material, front);
}

/// Uniform over the sphere.
std::vector<Vector3f> all_directions(int steps) {
  std::vector<Vector3f> directions;
  for (int i = 0; i < 2 * steps; ++i) {
    const float z = 1 - (static_cast<float>(i) + 0.5f) / static_cast<float>(steps), s = std::sqrt(1 - z * z);
    for (int k = 0; k < 4 * steps; ++k) {
      const float phi = 2 * relight::kPi * (static_cast<float>(k) + 0.5f) / static_cast<float>(4 * steps);
      directions.emplace_back(s * std::cos(phi), s * std::sin(phi), z);
    }
  }
  return directions;
}

TEST(Dielectric, ReflectsAsFresnel) {
  EXPECT_NEAR(relight::fresnel_dielectric(1, 1.5f), 0.04f, 1e-6f);
  EXPECT_NEAR(relight::fresnel_dielectric(1, 1 / 1.33f), std::pow(0.33f / 2.33f, 2.0f), 1e-6f);
  // At Brewster's angle, half of what is polarised across the plane of incidence, cos² of twice the angle, is left.
  const float brewster = std::atan(1.5f), root = std::cos(2 * brewster);
  EXPECT_NEAR(relight::fresnel_dielectric(std::cos(brewster), 1.5f), root * root / 2, 1e-6f);
  const float critical = std::asin(1 / 1.5f);
  EXPECT_LT(relight::fresnel_dielectric(std::cos(critical - 0.01f), 1 / 1.5f), 0.7f);
  EXPECT_EQ(relight::fresnel_dielectric(std::cos(critical + 0.01f), 1 / 1.5f), 1);
  // The same from both sides, at the angles of Snell.
  const float inside = std::asin(std::sin(0.7f) / 1.5f);
  EXPECT_NEAR(relight::fresnel_dielectric(std::cos(0.7f), 1.5f),
              relight::fresnel_dielectric(std::cos(inside), 1 / 1.5f), 1e-6f);
}

TEST(Dielectric, AMaterialKeepsItsSpecularFactor) {
  relight::Material material = glass_of(0, 1.33f);
  material.specular = 0.5f;
  EXPECT_NEAR(relight::fresnel(bsdf_of(material, true), 0.4f)[0], 0.5f * relight::fresnel_dielectric(0.4f, 1.33f),
              1e-6f);
  EXPECT_EQ(relight::fresnel(bsdf_of(material, false), 0.4f)[0], 1) << "total reflection";
}

TEST(Dielectric, RefractsAsSnell) {
  for (const bool front : {true, false}) {
    const relight::BsdfParams bsdf = bsdf_of(glass_of(0), front);
    const Vector3f v = Vector3f(0.3f, -0.4f, 0.8f).normalized();
    const float eta = front ? 1.5f : 1 / 1.5f;
    int refracted = 0, along = 0;
    for (std::uint32_t i = 0; i < 256; ++i) {
      relight::Sampler sampler(0, 0, i);
      const Vector3f w = relight::sample_direction(bsdf, v, sampler);
      if (w.z() > 0) continue;
      ++refracted;
      along += (eta * w.head<2>() + v.head<2>()).norm() < 0.02f ? 1 : 0;
    }
    EXPECT_GT(along, 0.95 * refracted) << "but for the tail of the lobe";
    const double expected = 1 - static_cast<double>(relight::fresnel_dielectric(v.z(), eta));
    EXPECT_NEAR(refracted / 256.0, expected, 0.02);
  }
}

TEST(Dielectric, ASheetDoesNotBendLight) {
  const relight::BsdfParams bsdf = bsdf_of(glass_of(0, 1.5f, true), true);
  const Vector3f v = Vector3f(0.6f, 0.2f, 0.7f).normalized();
  for (std::uint32_t i = 0; i < 64; ++i) {
    relight::Sampler sampler(0, 0, i);
    const Vector3f w = relight::sample_direction(bsdf, v, sampler);
    EXPECT_TRUE(w.z() >= 0 || (w + v).norm() < 0.05f);
  }
}

// Nothing is absorbed: what is not reflected is transmitted, but for light that meets several microfacets.
TEST(Dielectric, RoughInterfacesConserveEnergy) {
  const std::vector<Vector3f> directions = all_directions(300);
  const float dw = 4 * relight::kPi / static_cast<float>(directions.size());
  for (const bool thin_walled : {false, true}) {
    for (const bool front : {true, false}) {
      for (const float roughness : {0.4f, 0.6f}) {
        SCOPED_TRACE(std::to_string(thin_walled) + std::to_string(front) + ' ' + std::to_string(roughness));
        const relight::BsdfParams bsdf = bsdf_of(glass_of(roughness, 1.5f, thin_walled), front);
        const Vector3f v = Vector3f(0.2f, 0.3f, 0.9f).normalized();
        const float squeezed = bsdf.bends ? bsdf.eta * bsdf.eta : 1;
        double pdf = 0, power = 0, passed = 0;
        for (const Vector3f& w : directions) {
          pdf += static_cast<double>(relight::direction_pdf(bsdf, v, w) * dw);
          const float through = relight::transmitted(bsdf, v, w)[0] * squeezed;
          power += static_cast<double>((relight::reflected(bsdf, v, w)[0] + through) * std::abs(w.z()) * dw);
          passed += static_cast<double>(through * std::abs(w.z()) * dw);
        }
        double sampled = 0, sampled_passed = 0, valid = 0;
        constexpr int kCount = 1 << 14;
        for (std::uint32_t i = 0; i < kCount; ++i) {
          relight::Sampler sampler(0, 0, i);
          const Vector3f w = relight::sample_direction(bsdf, v, sampler);
          if (w.isZero(0)) continue;
          valid += 1.0 / kCount;
          const float through = relight::transmitted(bsdf, v, w)[0] * squeezed;
          const float all = relight::reflected(bsdf, v, w)[0] + through;
          const double share = static_cast<double>(std::abs(w.z()) / relight::direction_pdf(bsdf, v, w)) / kCount;
          sampled += static_cast<double>(all) * share;
          sampled_passed += static_cast<double>(through) * share;
        }
        EXPECT_NEAR(pdf, valid, 0.01);
        EXPECT_LT(power, 1.001);
        EXPECT_GT(power, roughness < 0.5f ? 0.96 : 0.8);
        EXPECT_NEAR(sampled, power, 0.005);
        EXPECT_NEAR(sampled_passed, passed, 0.005);
      }
    }
  }
}

// Walter et al. 2007, §5.1: radiance over the squared index is the same both ways.
TEST(Dielectric, IsReciprocal) {
  const Vector3f v = Vector3f(0.3f, 0.1f, 0.8f).normalized(), w = Vector3f(-0.1f, 0.05f, -0.9f).normalized();
  for (const float roughness : {0.3f, 0.8f}) {
    const relight::Rgb there = relight::transmitted(bsdf_of(glass_of(roughness), true), v, w);
    const Vector3f from = Vector3f(w.x(), w.y(), -w.z()), to = Vector3f(v.x(), v.y(), -v.z());
    const relight::Rgb back = relight::transmitted(bsdf_of(glass_of(roughness), false), from, to);
    EXPECT_GT(there[0], 0.001f);
    EXPECT_NEAR(back[0], there[0] * 2.25f, 1e-3f * back[0]);
  }
}

// Base colour colours what passes, once; metal and the rest of the body stay.
TEST(Dielectric, TransmissionIsAShareOfTheBody) {
  relight::Material material = glass_of(0.5f);
  material.base_color = {0.8f, 0.4f, 0};
  material.transmission = 0.75f;
  material.metallic = 0.2f;
  const relight::BsdfParams bsdf = bsdf_of(material, true);
  EXPECT_NEAR(bsdf.transmitted[0], 0.8f * 0.75f * 0.8f, 1e-6f);
  EXPECT_NEAR(bsdf.diffuse[1], 0.4f * 0.25f * 0.8f, 1e-6f);
  relight::Material opaque = material;
  opaque.transmission = 0;
  EXPECT_NEAR(bsdf.f0[0], bsdf_of(opaque, true).f0[0], 1e-6f);
  relight::BsdfParams body = bsdf, interface = bsdf;
  body.lobes = relight::Lobes::body;
  interface.lobes = relight::Lobes::interface;
  const Vector3f v = Vector3f(0.3f, 0.1f, 0.8f).normalized();
  for (const Vector3f& w : {Vector3f(-0.3f, 0.2f, 0.9f), Vector3f(-0.3f, 0.2f, -0.9f)}) {
    const auto scattered = [&](const relight::BsdfParams& of) {
      return (relight::reflected(of, v, w.normalized()) + relight::transmitted(of, v, w.normalized()))[0];
    };
    EXPECT_NEAR(scattered(body) + scattered(interface), scattered(bsdf), 1e-5f);
  }
}

}  // namespace
}  // namespace lumigraft::test
