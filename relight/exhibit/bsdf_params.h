#pragma once
// BSDF parameters: a Lambert body under a specular layer (glTF 2.0 metallic-roughness with KHR_materials_specular), and
// the energy split between them. Same as shaders/common/bsdf_params.glsl.
#include <Eigen/Core>

#include "relight/exhibit/exhibit.h"

namespace lumigraft::relight {

struct BsdfParams {
  Eigen::Array3f diffuse = Eigen::Array3f::Zero();  ///< albedo of the Lambert part
  Eigen::Array3f f0 = Eigen::Array3f::Zero();
  float f90 = 0;
  float alpha = 1;    ///< GGX roughness
  bool gltf = false;  ///< as in Material

  bool mirrors() const { return f90 > 0 || f0.maxCoeff() > 0; }
};

BsdfParams bsdf_params_of(const Eigen::Array3f& base_color, const Material& material);
BsdfParams bsdf_params_of(const Eigen::Array3f& diffuse, const Eigen::Array3f& f0, float alpha);

/// Schlick 1994.
Eigen::Array3f fresnel(const BsdfParams& bsdf, float cos_half);

/// What the layer leaves of the Lambert part, by cosines of the incident and the outgoing direction with the normal and
/// with the halfway vector. Light passes the layer on its way to the Lambert part and back (Ashikhmin & Shirley 2000);
/// in glTF 2.0 (appendix B) the Lambert part has what the layer does not reflect at the halfway vector.
Eigen::Array3f under_layer(const BsdfParams& bsdf, float cos_in, float cos_out, float cos_half);
/// Its mean over uniform incident light from the hemisphere, weighted by the cosine.
Eigen::Array3f under_layer_evenly(const BsdfParams& bsdf, float cos_out);

/// Reflectance for uniform incident light, layer and body together. Energy that a rough layer loses by masking is not
/// subtracted.
Eigen::Array3f reflectance_evenly(const BsdfParams& bsdf);

}  // namespace lumigraft::relight
