#include "relight/tracing/bsdf.h"

#include <algorithm>
#include <cmath>

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

constexpr float kMinCosine = 1e-3f;  // of v, as in brdf.glsl

float smith_lambda(float alpha, float cosine) {
  const float c2 = cosine * cosine;
  return 0.5f * (std::sqrt(1 + alpha * alpha * (1 - c2) / c2) - 1);
}

float normals_density(float alpha, const Vector3f& h) {
  const float a2 = alpha * alpha, q = a2 * h.z() * h.z() + h.x() * h.x() + h.y() * h.y();
  return a2 / (kPi * q * q);
}

/// Probability of sampling the specular lobe.
float specular_probability(const BsdfParams& bsdf, const Vector3f& v) {
  if (!bsdf.mirrors()) return 0;
  const Rgb f = fresnel(bsdf, v.z());
  const float mirror = luminance(f), diffuse = luminance(bsdf.diffuse * (1 - f));
  if (diffuse <= 0) return 1;
  return std::clamp(mirror / (mirror + diffuse), 0.1f, 0.9f);
}

/// Visible microfacets by spherical caps (Dupuy & Benyoub 2023).
Vector3f sample_microfacet(float alpha, const Vector3f& v, const Eigen::Vector2f& u) {
  const Vector3f stretched = Vector3f(alpha * v.x(), alpha * v.y(), v.z()).normalized();
  const float phi = 2 * kPi * u.x(), z = (1 - u.y()) * (1 + stretched.z()) - stretched.z();
  const float s = std::sqrt(std::clamp(1 - z * z, 0.0f, 1.0f));
  const Vector3f h = Vector3f(s * std::cos(phi), s * std::sin(phi), z) + stretched;
  return Vector3f(alpha * h.x(), alpha * h.y(), std::max(h.z(), 1e-6f)).normalized();
}

Vector3f lifted(const Vector3f& v) { return {v.x(), v.y(), std::max(v.z(), kMinCosine)}; }

}  // namespace

Rgb reflected(const BsdfParams& bsdf, const Vector3f& seen_from, const Vector3f& w) {
  if (w.z() <= 0) return Rgb::Zero();
  if (!bsdf.mirrors()) return bsdf.diffuse / kPi;
  const Vector3f v = lifted(seen_from), h = (v + w).normalized();
  const Rgb f = fresnel(bsdf, v.dot(h));
  const float masking = 1 / (1 + smith_lambda(bsdf.alpha, v.z()) + smith_lambda(bsdf.alpha, w.z()));
  const Rgb under = under_layer(bsdf, w.z(), v.z(), v.dot(h));
  return bsdf.diffuse * under / kPi + f * (normals_density(bsdf.alpha, h) * masking / (4 * v.z() * w.z()));
}

Vector3f sample_direction(const BsdfParams& bsdf, const Vector3f& seen_from, Sampler& sampler) {
  const Vector3f v = lifted(seen_from);
  const bool mirror = sampler.one() < specular_probability(bsdf, v);
  const Eigen::Vector2f u = sampler.two();
  if (mirror) {
    const Vector3f h = sample_microfacet(bsdf.alpha, v, u);
    return (2 * v.dot(h) * h - v).normalized();
  }
  const float r = std::sqrt(u.x()), phi = 2 * kPi * u.y();
  return {r * std::cos(phi), r * std::sin(phi), std::sqrt(std::max(1 - u.x(), 0.0f))};
}

float direction_pdf(const BsdfParams& bsdf, const Vector3f& seen_from, const Vector3f& w) {
  if (w.z() <= 0) return 0;
  const Vector3f v = lifted(seen_from);
  const float probability = specular_probability(bsdf, v);
  float pdf = (1 - probability) * w.z() / kPi;
  if (probability > 0) {
    const Vector3f h = (v + w).normalized();
    pdf += probability * normals_density(bsdf.alpha, h) / (4 * v.z() * (1 + smith_lambda(bsdf.alpha, v.z())));
  }
  return pdf;
}

}  // namespace lumigraft::relight
