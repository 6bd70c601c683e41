#include "relight/exhibit/bsdf_params.h"

#include <algorithm>
#include <cmath>

#include "relight/exhibit/sheen.h"

namespace lumigraft::relight {

constexpr float kMinAlpha = 2e-3f;  // at smaller alpha the lobe is narrower than any cone or lamp here
// With a smaller index light is bent by less than 0.01 tan of its angle, and the refracting microfacet of two given
// directions is not determined in single precision.
constexpr float kMinBend = 1.01f;
constexpr float kCoatF0 = 0.04f;          // of the index 1.5 (KHR_materials_clearcoat)
constexpr float kMinAttenuation = 1e-6f;  // at less than a millionth of the light, more would not be seen

BsdfParams bsdf_params_of(const Eigen::Array3f& base, const Material& m, bool front) {
  const float dielectric = 1 - m.metallic;
  BsdfParams bsdf{
      .diffuse = base * (dielectric * (1 - m.transmission)),
      .f0 = (m.normal_reflectance() * m.specular_color.array()).min(1) * (m.specular * dielectric) + base * m.metallic,
      .f90 = m.specular * dielectric + m.metallic,
      .alpha = std::max(m.roughness * m.roughness, kMinAlpha),
      .gltf = m.gltf};
  if (m.clearcoat > 0) {
    bsdf.coat = m.clearcoat;
    bsdf.coat_alpha = std::max(m.clearcoat_roughness * m.clearcoat_roughness, kMinAlpha);
  }
  if (m.anisotropy > 0) bsdf.stretch = std::lerp(bsdf.alpha, 1.0f, m.anisotropy * m.anisotropy) / bsdf.alpha;
  if (m.sheen_color.maxCoeff() > 0) {
    bsdf.sheen = m.sheen_color.array().min(1);
    bsdf.sheen_alpha = std::max(m.sheen_roughness * m.sheen_roughness, kMinSheenAlpha);
  }
  if (!(m.transmission > 0 && dielectric > 0)) return bsdf;
  bsdf.transmitted = base * (dielectric * m.transmission);
  bsdf.eta = m.thin_walled || front ? m.ior : 1 / m.ior;
  bsdf.bends = !m.thin_walled && m.ior >= kMinBend;
  if (!m.thin_walled && !front) bsdf.coat = 0;  // it is on the outside of a volume
  if (!m.thin_walled && !bsdf.bends) {          // what does not bend light does not scatter it either
    bsdf.alpha = kMinAlpha;
    bsdf.stretch = 1;
  }
  return bsdf;
}

BsdfParams bsdf_params_of(const Eigen::Array3f& diffuse, const Eigen::Array3f& f0, float alpha) {
  return {.diffuse = diffuse, .f0 = f0, .f90 = f0.maxCoeff() > 0 ? 1.0f : 0.0f, .alpha = std::max(alpha, kMinAlpha)};
}

Eigen::Array3f absorption_of(const Material& material) {
  return -material.attenuation_color.array().max(kMinAttenuation).log() / material.attenuation_distance_m;
}

float fresnel_dielectric(float cos_in, float eta) {
  const float c = std::clamp(cos_in, 0.0f, 1.0f), g2 = eta * eta - 1 + c * c;
  if (!(g2 > 0)) return 1;
  const float g = std::sqrt(g2), a = (g - c) / (g + c), b = (c * (g + c) - 1) / (c * (g - c) + 1);
  return 0.5f * a * a * (1 + b * b);
}

Eigen::Array3f fresnel(const BsdfParams& bsdf, float cos_half) {
  if (bsdf.transmits()) {
    const float ahead = (bsdf.eta - 1) * (bsdf.eta - 1) / ((bsdf.eta + 1) * (bsdf.eta + 1));
    const float exact = fresnel_dielectric(cos_half, bsdf.eta);
    if (exact >= 1) return Eigen::Array3f::Ones();  // total reflection
    return bsdf.f0 + (bsdf.f90 - bsdf.f0) * ((exact - ahead) / (1 - ahead));
  }
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

float coat_share(float coat, float cos_out) {
  const float m = 1 - std::clamp(cos_out, 0.0f, 1.0f), m2 = m * m;
  return coat * (kCoatF0 + (1 - kCoatF0) * (m2 * m2 * m));
}

float coat_share_evenly(float coat) { return coat * (kCoatF0 + (1 - kCoatF0) / 21); }

float under_sheen(const BsdfParams& bsdf, float cos_in, float cos_out) {
  if (!bsdf.has_sheen()) return 1;
  const float larger = std::max(sheen_albedo(bsdf.sheen_alpha, cos_in), sheen_albedo(bsdf.sheen_alpha, cos_out));
  return 1 - bsdf.sheen.maxCoeff() * larger;
}

float under_sheen_evenly(const BsdfParams& bsdf, float cos_out) {
  return bsdf.has_sheen() ? 1 - bsdf.sheen.maxCoeff() * larger_sheen_albedo(bsdf.sheen_alpha, cos_out) : 1;
}

float under_sheen_evenly(const BsdfParams& bsdf) {
  return bsdf.has_sheen() ? 1 - bsdf.sheen.maxCoeff() * larger_sheen_albedo_evenly(bsdf.sheen_alpha) : 1;
}

Eigen::Array3f reflectance_ahead(const BsdfParams& bsdf) {
  const float share = coat_share(bsdf.coat, 1);
  Eigen::Array3f under_coat = bsdf.f0;
  if (bsdf.has_sheen())
    under_coat = bsdf.sheen * sheen_albedo(bsdf.sheen_alpha, 1) + under_sheen_evenly(bsdf, 1) * bsdf.f0;
  return share + (1 - share) * under_coat;
}

Eigen::Array3f reflectance_evenly(const BsdfParams& bsdf) {
  const Eigen::Array3f layer = bsdf.f0 + (bsdf.f90 - bsdf.f0) / 21;
  const Eigen::Array3f body =
      bsdf.gltf ? (bsdf.diffuse * (1 - bsdf.f0 - (bsdf.f90 - bsdf.f0) * 0.0036f)).eval()  // as above, of all angles
                : (bsdf.diffuse * (1 - layer) * (1 - layer)).eval();
  Eigen::Array3f under_coat = layer + body;
  if (bsdf.has_sheen())
    under_coat = bsdf.sheen * sheen_albedo_evenly(bsdf.sheen_alpha) + under_sheen_evenly(bsdf) * under_coat;
  const float share = coat_share_evenly(bsdf.coat);
  return share + (1 - share) * under_coat;
}

}  // namespace lumigraft::relight
