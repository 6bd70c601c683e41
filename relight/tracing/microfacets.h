#pragma once
// GGX microfacets (Walter et al. 2007) with Smith masking, whose roughness `alpha` along x and y may differ (Heitz
// 2014). Directions as in bsdf.h; h: normal of a microfacet.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace lumigraft::relight {

constexpr float kPi = 3.14159265358979f;

constexpr float kMinCosine = 1e-3f;  // of v, as in brdf.glsl
inline Eigen::Vector3f lifted(const Eigen::Vector3f& v) { return {v.x(), v.y(), std::max(v.z(), kMinCosine)}; }

/// Heitz 2014, eq. 72, and section 5.4 where x and y differ.
inline float smith_lambda(const Eigen::Array2f& alpha, const Eigen::Vector3f& w) {
  return 0.5f * (std::sqrt(1 + (alpha * w.head<2>().array()).square().sum() / (w.z() * w.z())) - 1);
}

/// Per solid angle and area of the surface, 1/sr (Heitz 2014, section 5.4).
inline float normals_density(const Eigen::Array2f& alpha, const Eigen::Vector3f& h) {
  const float a2 = alpha.x() * alpha.y();
  const float x = alpha.y() * h.x(), y = alpha.x() * h.y(), z = a2 * h.z(), q = x * x + y * y + z * z;
  return a2 * a2 * a2 / (kPi * q * q);
}

/// Density of `sample_microfacet`, 1/sr (Heitz 2014, eq. 19). v and h are above the surface.
inline float visible_normals_density(const Eigen::Array2f& alpha, const Eigen::Vector3f& v, const Eigen::Vector3f& h) {
  return normals_density(alpha, h) * std::max(v.dot(h), 0.0f) / (v.z() * (1 + smith_lambda(alpha, v)));
}

/// Visible microfacets by spherical caps (Dupuy & Benyoub 2023).
inline Eigen::Vector3f sample_microfacet(const Eigen::Array2f& alpha, const Eigen::Vector3f& v,
                                         const Eigen::Vector2f& u) {
  using Eigen::Vector3f;
  const Vector3f stretched = Vector3f(alpha.x() * v.x(), alpha.y() * v.y(), v.z()).normalized();
  const float phi = 2 * kPi * u.x(), z = (1 - u.y()) * (1 + stretched.z()) - stretched.z();
  const float s = std::sqrt(std::clamp(1 - z * z, 0.0f, 1.0f));
  const Vector3f h = Vector3f(s * std::cos(phi), s * std::sin(phi), z) + stretched;
  return Vector3f(alpha.x() * h.x(), alpha.y() * h.y(), std::max(h.z(), 1e-6f)).normalized();
}

}  // namespace lumigraft::relight
