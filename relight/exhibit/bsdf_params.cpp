#include "relight/exhibit/bsdf_params.h"

#include <algorithm>
#include <cmath>

namespace lumigraft::relight {

constexpr float kMinAlpha = 2e-3f;  // at smaller alpha the lobe is narrower than any cone or lamp here

BsdfParams bsdf_params_of(const Eigen::Array3f& base, const Material& m) {
  return {.diffuse = base * (1 - m.metallic),
          .f0 = 0.04f * m.specular * (1 - m.metallic) + base * m.metallic,
          .f90 = m.specular * (1 - m.metallic) + m.metallic,
          .alpha = std::max(m.roughness * m.roughness, kMinAlpha),
          .gltf = m.gltf};
}

BsdfParams bsdf_params_of(const Eigen::Array3f& diffuse, const Eigen::Array3f& f0, float alpha) {
  return {diffuse, f0, f0.maxCoeff() > 0 ? 1.0f : 0.0f, std::max(alpha, kMinAlpha)};
}

Eigen::Array3f fresnel(const BsdfParams& bsdf, float cos_half) {
  const float m = 1 - std::clamp(cos_half, 0.0f, 1.0f), m2 = m * m;
  return bsdf.f0 + (bsdf.f90 - bsdf.f0) * (m2 * m2 * m);
}

Eigen::Array3f under_layer(const BsdfParams& bsdf, float cos_in, float cos_out, float cos_half) {
  if (bsdf.gltf) return 1 - fresnel(bsdf, cos_half);
  return (1 - fresnel(bsdf, cos_in)) * (1 - fresnel(bsdf, cos_out));
}

Eigen::Array3f under_layer_evenly(const BsdfParams& bsdf, float cos_out) {
  if (bsdf.gltf) {
    // Mean of Schlick's term at the halfway vector, fitted to its integral: up to 0.0006 off.
    const float term = 0.028f * std::pow(1 - std::clamp(cos_out, 0.0f, 1.0f), 2.5f);
    return 1 - (bsdf.f0 + (bsdf.f90 - bsdf.f0) * term);
  }
  const Eigen::Array3f in = 1 - (bsdf.f0 + (bsdf.f90 - bsdf.f0) / 21);  // cosine-weighted mean of Schlick's term
  return in * (1 - fresnel(bsdf, cos_out));
}

Eigen::Array3f reflectance_evenly(const BsdfParams& bsdf) {
  const Eigen::Array3f layer = bsdf.f0 + (bsdf.f90 - bsdf.f0) / 21;
  if (bsdf.gltf)
    return layer + bsdf.diffuse * (1 - bsdf.f0 - (bsdf.f90 - bsdf.f0) * 0.0036f);  // as above, of all angles
  return layer + bsdf.diffuse * (1 - layer) * (1 - layer);
}

}  // namespace lumigraft::relight
