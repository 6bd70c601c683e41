// BSDF parameters: a Lambert body under a specular layer (glTF 2.0 metallic-roughness), and the energy split between
// them. Same as relight/exhibit/bsdf_params.h.
#ifndef BSDF_PARAMS_GLSL
#define BSDF_PARAMS_GLSL

struct BsdfParams {
  vec3 diffuse;  // albedo of the Lambert part
  vec3 f0;
  float f90;
  float alpha;  // GGX roughness
  bool gltf;    // layer and body are mixed as in glTF 2.0, appendix B; else light passes the layer twice
};

BsdfParams bsdf_of(vec3 base, float roughness, float metallic, float specular) {
  BsdfParams l;
  l.diffuse = base * (1.0 - metallic);
  l.f0 = mix(vec3(0.04 * specular), base, metallic);
  l.f90 = mix(specular, 1.0, metallic);
  l.alpha = max(roughness * roughness, 2e-3);  // at smaller alpha the lobe is narrower than any cone or lamp here
  l.gltf = false;
  return l;
}

// Schlick 1994.
vec3 fresnel(BsdfParams l, float cos_half) { return l.f0 + (l.f90 - l.f0) * pow(1.0 - clamp(cos_half, 0.0, 1.0), 5.0); }

// Light passes the layer on its way to the Lambert part and back (Ashikhmin & Shirley 2000): transmittance of one pass,
// and its mean over uniform incident light from the hemisphere.
vec3 through(BsdfParams l, float cosine) { return 1.0 - fresnel(l, cosine); }
vec3 through_evenly(BsdfParams l) { return 1.0 - l.f0 - (l.f90 - l.f0) / 21.0; }

// What the layer leaves of the Lambert part: of light from w, seen from v; and of uniform light from the hemisphere,
// where for glTF the mean of Schlick's term at the halfway vector is fitted (bsdf_params.cpp).
vec3 under_layer(BsdfParams l, vec3 n, vec3 v, vec3 w) {
  if (l.gltf) return 1.0 - fresnel(l, dot(v, normalize(v + w)));
  return through(l, dot(n, w)) * through(l, dot(n, v));
}
vec3 under_layer_evenly(BsdfParams l, float cos_v) {
  if (l.gltf) return 1.0 - l.f0 - (l.f90 - l.f0) * 0.028 * pow(1.0 - clamp(cos_v, 0.0, 1.0), 2.5);
  return through_evenly(l) * through(l, cos_v);
}

// Directional reflectance, layer and body together. Energy that a rough layer loses by masking is not subtracted.
vec3 reflectance(BsdfParams l, float cosine) { return fresnel(l, cosine) + l.diffuse * under_layer_evenly(l, cosine); }
#endif
