#include "relight/exhibit/bsdf_params.h"

#include <algorithm>

namespace lumigraft::relight {

constexpr float kMinAlpha = 2e-3f;  // at smaller alpha the lobe is narrower than any cone or lamp here

BsdfParams bsdf_params_of(const Eigen::Array3f& base, const Material& m) {
  return {.diffuse = base * (1 - m.metallic),
          .f0 = 0.04f * m.specular * (1 - m.metallic) + base * m.metallic,
          .f90 = m.specular * (1 - m.metallic) + m.metallic,
          .alpha = std::max(m.roughness * m.roughness, kMinAlpha)};
}

BsdfParams bsdf_params_of(const Eigen::Array3f& diffuse, const Eigen::Array3f& f0, float alpha) {
  return {diffuse, f0, f0.maxCoeff() > 0 ? 1.0f : 0.0f, std::max(alpha, kMinAlpha)};
}

Eigen::Array3f fresnel(const BsdfParams& bsdf, float cos_half) {
  const float m = 1 - std::clamp(cos_half, 0.0f, 1.0f), m2 = m * m;
  return bsdf.f0 + (bsdf.f90 - bsdf.f0) * (m2 * m2 * m);
}

Eigen::Array3f through(const BsdfParams& bsdf, float cosine) { return 1 - fresnel(bsdf, cosine); }

Eigen::Array3f through_evenly(const BsdfParams& bsdf) {
  return 1 - (bsdf.f0 + (bsdf.f90 - bsdf.f0) / 21);  // cosine-weighted mean of Schlick's term
}

Eigen::Array3f reflectance_evenly(const BsdfParams& bsdf) {
  const Eigen::Array3f passing = through_evenly(bsdf);
  return 1 - passing + bsdf.diffuse * passing * passing;
}

}  // namespace lumigraft::relight
