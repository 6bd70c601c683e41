#pragma once
// BSDF parameters: a Lambert body under a specular layer (glTF 2.0 metallic-roughness with KHR_materials_specular), and
// the energy split between them, as in shaders/common/bsdf_params.glsl. KHR_materials_transmission: a part of the light
// under the layer passes the surface. KHR_materials_clearcoat: a coat reflects a share of the light, by Fresnel at the
// coat's normal, and all of the above has the rest. KHR_materials_sheen: fibres above all but the coat, which leave
// what the larger of their reflectances for both directions does not take. KHR_materials_anisotropy: the layer's facets
// are wider along one direction.
#include <Eigen/Core>

#include "relight/exhibit/exhibit.h"

namespace lumigraft::relight {

/// Parts of a BSDF. The interface is what microfacets reflect and transmit, the body what is scattered under it.
enum class Lobes { all, body, interface, reflection, transmission };

struct BsdfParams {
  Eigen::Array3f diffuse = Eigen::Array3f::Zero();  ///< albedo of the Lambert part
  Eigen::Array3f f0 = Eigen::Array3f::Zero();
  float f90 = 0;
  float alpha = 1;    ///< GGX roughness, of an anisotropic layer that across `along`
  float stretch = 1;  ///< of an anisotropic one: the roughness along that direction over alpha
  Eigen::Vector3f along = Eigen::Vector3f::UnitX();  ///< of a SurfaceHit: tag frame; PathVertex has it along x
  bool gltf = false;                                 ///< as in Material
  /// Colour of what passes the surface, without the layer's share; zero: opaque.
  Eigen::Array3f transmitted = Eigen::Array3f::Zero();
  float eta = 1;       ///< of a transmissive surface: index of refraction beyond it over that on the ray's side
  bool bends = false;  ///< whether transmitted light is refracted; else it passes straight
  float coat = 0, coat_alpha = 1;                          ///< intensity of the coat; its GGX roughness
  Eigen::Vector3f coat_normal = Eigen::Vector3f::UnitZ();  ///< unit, shading frame; of a SurfaceHit: tag frame
  Eigen::Array3f sheen = Eigen::Array3f::Zero();           ///< its colour
  float sheen_alpha = 1;                                   ///< as in sheen.h
  Lobes lobes = Lobes::all;

  bool mirrors() const { return f90 > 0 || f0.maxCoeff() > 0 || transmits() || coat > 0 || has_sheen(); }
  bool has_sheen() const { return sheen.maxCoeff() > 0; }
  /// GGX roughness along x and y of the shading frame.
  Eigen::Array2f alphas() const { return {alpha * stretch, alpha}; }
  bool transmits() const { return transmitted.maxCoeff() > 0; }
  bool has_body() const { return lobes == Lobes::all || lobes == Lobes::body; }
  bool has_reflection() const { return lobes != Lobes::body && lobes != Lobes::transmission; }
  bool has_transmission() const { return lobes != Lobes::body && lobes != Lobes::reflection; }
};

/// `front`: seen from the side of its normals, for a surface that bounds a volume.
BsdfParams bsdf_params_of(const Eigen::Array3f& base_color, const Material& material, bool front = true);
BsdfParams bsdf_params_of(const Eigen::Array3f& diffuse, const Eigen::Array3f& f0, float alpha);

/// Of a volume, 1/m of the model, from its colour at its distance (Beer 1852); nearly black instead of black.
Eigen::Array3f absorption_of(const Material& material);

/// Reflectance of a smooth boundary between dielectrics for unpolarised light; `eta`: index of refraction beyond it
/// over that before it (Walter et al. 2007, eq. 22; total reflection: 1).
float fresnel_dielectric(float cos_in, float eta);

/// Schlick 1994; of a transmissive surface, with the exact curve from f0 to f90.
Eigen::Array3f fresnel(const BsdfParams& bsdf, float cos_half);

/// What the layer leaves of the Lambert part, by cosines of the incident and the outgoing direction with the normal and
/// with the halfway vector. Light passes the layer on its way to the Lambert part and back (Ashikhmin & Shirley 2000);
/// in glTF 2.0 (appendix B) the Lambert part has what the layer does not reflect at the halfway vector.
Eigen::Array3f under_layer(const BsdfParams& bsdf, float cos_in, float cos_out, float cos_half);
/// Its mean over uniform incident light from the hemisphere, weighted by the cosine.
Eigen::Array3f under_layer_evenly(const BsdfParams& bsdf, float cos_out);

/// Share of the light that a coat of this intensity reflects to a direction, by its cosine with the coat's normal
/// (Schlick 1994), or to all of them in the mean, weighted by the cosine.
float coat_share(float coat, float cos_out);
inline float coat_share(const BsdfParams& bsdf, const Eigen::Vector3f& v) {
  return bsdf.coat > 0 ? coat_share(bsdf.coat, v.dot(bsdf.coat_normal)) : 0;
}
float coat_share_evenly(float coat);

/// What the sheen leaves of the rest, by cosines of both directions with the normal; its mean over one of them and over
/// both, weighted by their cosines. The larger of the two albedos, as reflectance is the same in both directions.
float under_sheen(const BsdfParams& bsdf, float cos_in, float cos_out);
float under_sheen_evenly(const BsdfParams& bsdf, float cos_out);
float under_sheen_evenly(const BsdfParams& bsdf);

/// Reflectance at normal incidence, without the body.
Eigen::Array3f reflectance_ahead(const BsdfParams& bsdf);

/// Reflectance for uniform incident light, coat, sheen, layer and body together. Energy that a rough layer loses by
/// masking is not subtracted.
Eigen::Array3f reflectance_evenly(const BsdfParams& bsdf);

}  // namespace lumigraft::relight
