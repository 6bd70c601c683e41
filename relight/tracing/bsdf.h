#pragma once
// glTF 2.0 metallic-roughness with KHR_materials_specular: Lambert under GGX (Walter et al. 2007), height-correlated
// Smith masking (Heitz 2014, eq. 99), Schlick's Fresnel, all as in shaders/common/brdf.glsl. Materials of glTF files
// are mixed as in appendix B there: diffuse / π · (1 - F(v·h)). Others, as those of real surfaces, are a physical
// layer: light of the Lambert part passes it twice, diffuse / π · (1 - F(n·l)) (1 - F(n·v)), and internal reflection
// counts as lost. At grazing angles glTF's is brighter, and in the mean 8 % for a dielectric.
//
// A coat (KHR_materials_clearcoat) reflects by GGX at a normal of its own; all else is weighted by what it leaves for
// v: f = (1 - s) f_base + s f_coat, s = coat · F(v·n_coat). So it takes no energy, but is not reciprocal. Between coat
// and layer, sheen (KHR_materials_sheen) reflects by its own lobe and leaves under_sheen of the rest.
//
// The layer's lobe may be wider along x than along y (KHR_materials_anisotropy).
//
// Transmissive materials also have what passes the interface (dielectric.h), with the exact Fresnel curve.
//
// All directions are in the shading frame: unit, away from the surface, z along the normal; v towards the outgoing
// light.
#include <Eigen/Core>

#include "relight/exhibit/bsdf_params.h"
#include "relight/tracing/microfacets.h"
#include "relight/tracing/sampler.h"
#include "relight/tracing/trace_scene.h"

namespace lumigraft::relight {

/// Reflected radiance over irradiance, for w above the surface, else 0.
Rgb reflected(const BsdfParams& bsdf, const Eigen::Vector3f& v, const Eigen::Vector3f& w);

/// Samples a direction w for a given v, with a density that follows the material; z <= 0: below the surface, where only
/// transmissive materials have light.
Eigen::Vector3f sample_direction(const BsdfParams& bsdf, const Eigen::Vector3f& v, Sampler& sampler);
float direction_pdf(const BsdfParams& bsdf, const Eigen::Vector3f& v, const Eigen::Vector3f& w);  ///< 1/sr

/// Probability of the interface if it or the body is chosen at random, by their luminances.
float interface_probability(const BsdfParams& bsdf, const Eigen::Vector3f& v);

/// Y of linear sRGB.
inline float luminance(const Rgb& c) { return 0.2126f * c[0] + 0.7152f * c[1] + 0.0722f * c[2]; }

}  // namespace lumigraft::relight
