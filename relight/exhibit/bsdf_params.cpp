#include "relight/exhibit/bsdf_params.h"

#include <algorithm>

namespace lumigraft::relight {
namespace {

constexpr float kLeastAlpha = 2e-3f;  // at smaller alpha the lobe is narrower than any cone or lamp here

}  // namespace

BsdfParams bsdf_params_of(const Eigen::Array3f& base, const Material& m) {
  BsdfParams look;
  look.diffuse = base * (1 - m.metallic);
  look.f0 = 0.04f * m.specular * (1 - m.metallic) + base * m.metallic;
  look.f90 = m.specular * (1 - m.metallic) + m.metallic;
  look.alpha = std::max(m.roughness * m.roughness, kLeastAlpha);
  return look;
}

BsdfParams bsdf_params_of(const Eigen::Array3f& diffuse, const Eigen::Array3f& f0, float alpha) {
  return {diffuse, f0, f0.maxCoeff() > 0 ? 1.0f : 0.0f, std::max(alpha, kLeastAlpha)};
}

Eigen::Array3f fresnel(const BsdfParams& look, float cos_half) {
  const float m = 1 - std::clamp(cos_half, 0.0f, 1.0f), m2 = m * m;
  return look.f0 + (look.f90 - look.f0) * (m2 * m2 * m);
}

Eigen::Array3f through(const BsdfParams& look, float cosine) { return 1 - fresnel(look, cosine); }

Eigen::Array3f through_evenly(const BsdfParams& look) {
  return 1 - (look.f0 + (look.f90 - look.f0) / 21);  // cosine-weighted mean of Schlick's term
}

Eigen::Array3f reflectance_evenly(const BsdfParams& look) {
  const Eigen::Array3f passing = through_evenly(look);
  return 1 - passing + look.diffuse * passing * passing;
}

}  // namespace lumigraft::relight
