// glTF 2.0 metallic-roughness: Lambert under GGX (Walter et al. 2007), height-correlated Smith masking (Heitz 2014,
// eq. 99), Schlick's Fresnel.
#ifndef BRDF_GLSL
#define BRDF_GLSL
#include "common/bsdf_params.glsl"
#include "common/frame.glsl"

BsdfParams bsdf_of(Surface s) {
  return bsdf_of(s.base_color_roughness.rgb, s.base_color_roughness.a, s.metallic_specular.x, s.metallic_specular.y);
}

float smith_lambda(float alpha, float cosine) {
  float c2 = cosine * cosine;
  return 0.5 * (sqrt(1.0 + alpha * alpha * (1.0 - c2) / c2) - 1.0);
}

// Specular BRDF: D F G / (4 n·v n·l).
vec3 ggx(BsdfParams l, vec3 n, vec3 v, vec3 w) {
  float nv = max(dot(n, v), 1e-3), nl = dot(n, w);
  if (nl <= 0.0 || l.f90 + l.f0.x + l.f0.y + l.f0.z <= 0.0) return vec3(0);
  vec3 h = normalize(v + w);
  float nh = clamp(dot(n, h), 0.0, 1.0), a2 = l.alpha * l.alpha;
  float q = nh * nh * (a2 - 1.0) + 1.0;
  float d = a2 / (kPi * q * q);
  float g = 1.0 / (1.0 + smith_lambda(l.alpha, nv) + smith_lambda(l.alpha, nl));
  return fresnel(l, dot(v, h)) * (d * g / (4.0 * nv * nl));
}

// For a lamp sample of half angle a instead of a point: GGX widened to α' = α + tan(a)/2, with energy preserved by
// (α/α')² (Karis 2013, "Real Shading in Unreal Engine 4", representative spheres).
vec3 ggx_wide(BsdfParams l, vec3 n, vec3 v, vec3 w, float tan_half) {
  BsdfParams wide = l;
  wide.alpha = min(1.0, l.alpha + 0.5 * tan_half);
  return ggx(wide, n, v, w);
}

// Samples a visible microfacet (Dupuy & Benyoub 2023, spherical caps); u in [0,1)². Returns the reflected direction and
// its weight F G2/G1.
vec3 ggx_sample(BsdfParams l, vec3 n, vec3 v, vec2 u, out vec3 weight) {
  vec3 x, y;
  basis(n, x, y);
  vec3 vl = vec3(dot(v, x), dot(v, y), max(dot(v, n), 1e-3));
  vec3 vs = normalize(vec3(l.alpha * vl.xy, vl.z));
  float phi = 2.0 * kPi * u.x, z = (1.0 - u.y) * (1.0 + vs.z) - vs.z;
  float s = sqrt(clamp(1.0 - z * z, 0.0, 1.0));
  vec3 h = vec3(s * cos(phi), s * sin(phi), z) + vs;
  h = normalize(vec3(l.alpha * h.xy, max(h.z, 1e-6)));
  vec3 wl = reflect(-vl, h);
  if (wl.z <= 0.0) {
    weight = vec3(0);
    return n;
  }
  float lv = smith_lambda(l.alpha, vl.z);
  weight = fresnel(l, dot(vl, h)) * (1.0 + lv) / (1.0 + lv + smith_lambda(l.alpha, wl.z));
  return wl.x * x + wl.y * y + wl.z * n;
}
#endif
