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
  float alpha = 1;  ///< GGX roughness

  bool mirrors() const { return f90 > 0 || f0.maxCoeff() > 0; }
};

BsdfParams bsdf_params_of(const Eigen::Array3f& base_color, const Material& material);
BsdfParams bsdf_params_of(const Eigen::Array3f& diffuse, const Eigen::Array3f& f0, float alpha);

/// Schlick 1994.
Eigen::Array3f fresnel(const BsdfParams& bsdf, float cos_half);

/// Light passes the layer on its way to the Lambert part and back (Ashikhmin & Shirley 2000): transmittance of one
/// pass, and its mean over uniform incident light from the hemisphere.
Eigen::Array3f through(const BsdfParams& bsdf, float cosine);
Eigen::Array3f through_evenly(const BsdfParams& bsdf);

/// Reflectance for uniform incident light, layer and body together. Energy that a rough layer loses by masking is not
/// subtracted.
Eigen::Array3f reflectance_evenly(const BsdfParams& bsdf);

}  // namespace lumigraft::relight
