// A Lambert body under a layer that mirrors (glTF 2.0 metallic-roughness), and how the two share the light that arrives:
// as relight/exhibit/bsdf_params.h.
#ifndef BSDF_PARAMS_GLSL
#define BSDF_PARAMS_GLSL

struct Look {
  vec3 diffuse;  // albedo of the Lambert part
  vec3 f0;
  float f90;
  float alpha;  // GGX
};

Look look_of(vec3 base, float roughness, float metallic, float specular) {
  Look l;
  l.diffuse = base * (1.0 - metallic);
  l.f0 = mix(vec3(0.04 * specular), base, metallic);
  l.f90 = mix(specular, 1.0, metallic);
  l.alpha = max(roughness * roughness, 2e-3);  // below it the lobe is narrower than any cone or lamp here
  return l;
}

// Schlick 1994.
vec3 fresnel(Look l, float cos_half) { return l.f0 + (l.f90 - l.f0) * pow(1.0 - clamp(cos_half, 0.0, 1.0), 5.0); }

// Light reaches the Lambert part through the layer and leaves through it again (Ashikhmin & Shirley 2000): what each way
// lets pass, and the mean over light that comes evenly from the hemisphere.
vec3 through(Look l, float cosine) { return 1.0 - fresnel(l, cosine); }
vec3 through_evenly(Look l) { return 1.0 - l.f0 - (l.f90 - l.f0) / 21.0; }

// Share of the light from one direction that the surface sends back, from the layer and from below it. What a rough layer
// loses by masking is not taken off.
vec3 reflectance(Look l, float cosine) { return fresnel(l, cosine) + l.diffuse * through(l, cosine) * through_evenly(l); }
#endif
