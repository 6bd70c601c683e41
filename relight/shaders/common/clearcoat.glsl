// A dielectric coat of the index 1.5 over a surface (KHR_materials_clearcoat), as in relight/exhibit/bsdf_params.h.
#ifndef CLEARCOAT_GLSL
#define CLEARCOAT_GLSL
#include "common/bsdf_params.glsl"

const float kCoatF0 = 0.04;

// Intensity and roughness in one number that halves hold exactly: 32 and 64 levels. 0: no coat.
float pack_coat(vec2 coat) { return coat.x > 0.0 ? 64.0 * floor(31.0 * coat.x + 0.5) + floor(63.0 * coat.y + 0.5) : 0.0; }
vec2 unpack_coat(float packed) {
  float intensity = floor(packed / 64.0);
  return vec2(intensity / 31.0, (packed - 64.0 * intensity) / 63.0);
}

// Share of the light that the coat reflects to a direction, by its cosine with the normal (Schlick 1994). All else has
// the rest.
float coat_share(float intensity, float cosine) {
  return intensity * (kCoatF0 + (1.0 - kCoatF0) * pow(1.0 - clamp(cosine, 0.0, 1.0), 5.0));
}

// Its lobe, without Fresnel.
BsdfParams coat_lobe(float roughness) {
  BsdfParams l;
  l.diffuse = vec3(0);
  l.f0 = vec3(1);
  l.f90 = 1.0;
  l.alpha = max(roughness * roughness, 2e-3);
  l.gltf = true;
  return l;
}
#endif
