#pragma once
// A Lambert body under a layer that mirrors (glTF 2.0 metallic-roughness with KHR_materials_specular), and how the two
// share the light that arrives. shaders/bsdf_params.glsl says the same.
#include <Eigen/Core>

#include "relight/exhibit/exhibit.h"

namespace lumigraft::relight {

struct BsdfParams {
  Eigen::Array3f diffuse = Eigen::Array3f::Zero();  ///< albedo of the Lambert part
  Eigen::Array3f f0 = Eigen::Array3f::Zero();
  float f90 = 0;
  float alpha = 1;  ///< GGX

  bool mirrors() const { return f90 > 0 || f0.maxCoeff() > 0; }
};

BsdfParams bsdf_params_of(const Eigen::Array3f& base_color, const Material& material);
BsdfParams bsdf_params_of(const Eigen::Array3f& diffuse, const Eigen::Array3f& f0, float alpha);

/// Schlick 1994.
Eigen::Array3f fresnel(const BsdfParams& look, float cos_half);

/// Light reaches the Lambert part through the layer and leaves through it again (Ashikhmin & Shirley 2000): what each
/// way lets pass, and the mean over light that comes evenly from the hemisphere.
Eigen::Array3f through(const BsdfParams& look, float cosine);
Eigen::Array3f through_evenly(const BsdfParams& look);

/// Share of evenly arriving light that the surface sends back, from the layer and from below it. What a rough layer
/// loses by masking is not taken off.
Eigen::Array3f reflectance_evenly(const BsdfParams& look);

}  // namespace lumigraft::relight
