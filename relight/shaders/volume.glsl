// The volumes that cones march through, and how they are looked up.
//
// Occlusion comes from signed distance (real: the fused field; virtual: the objects'), never from filtered opacity, so
// the real and the changed scene share it exactly and thesis eq. 5.27's error does not arise. The colour volumes hold
// radiance times a surface weight and that weight; their ratio is the mean radiance of the surface inside a footprint,
// at every level of the hierarchy.
#ifndef VOLUME_GLSL
#define VOLUME_GLSL
#include "frame.glsl"

layout(binding = 1) uniform sampler3D virtual_distance_m;
layout(binding = 2) uniform sampler3D real_distance_0;
layout(binding = 3) uniform sampler3D real_distance_1;
layout(binding = 4) uniform sampler3D real_radiance_0;  // L_mu
layout(binding = 5) uniform sampler3D real_radiance_1;
layout(binding = 6) uniform sampler3D virtual_radiance_0;  // L_rho of the virtual objects
layout(binding = 7) uniform sampler3D virtual_radiance_1;
layout(binding = 8) uniform sampler3D real_change_0;  // L_delta of real surfaces, with L_mu's weight
layout(binding = 9) uniform sampler3D real_change_1;
layout(binding = 10) uniform sampler2D environment;  // remainder of the fish-eye picture, equal-area octahedral

const float kFar = 1e3;

vec3 grid_low(vec4 g) { return g.xyz - 0.5 * g.w; }
vec3 cascade_high(int c) { return grid_low(frame.cascade[c]) + float(frame.grid.x) * frame.cascade[c].w; }
bool in_cascade(int c, vec3 p, float margin_voxels) {
  float m = margin_voxels * frame.cascade[c].w;
  return all(greaterThan(p, grid_low(frame.cascade[c]) + m)) && all(lessThan(p, cascade_high(c) - m));
}
vec3 cascade_uvw(int c, vec3 p) { return (p - grid_low(frame.cascade[c])) / (float(frame.grid.x) * frame.cascade[c].w); }

// Signed distance to the virtual objects. Outside the volume a lower bound.
float virtual_distance(vec3 p) {
  vec3 low = grid_low(frame.virtual_grid), size = vec3(frame.grid.yzw) * frame.virtual_grid.w;
  vec3 centre = low + 0.5 * size, half_size = 0.5 * size - 0.5 * frame.virtual_grid.w;
  vec3 out_by = abs(p - centre) - half_size;
  float beyond = length(max(out_by, 0.0));
  if (beyond > 0.0) return beyond + 1.5 * frame.virtual_grid.w;  // the volume keeps that margin around the objects
  return textureLod(virtual_distance_m, (p - low) / size, 0.0).r;
}

// Signed distance to the real surfaces, as far as they are known; a lower bound far from them, kFar outside the volumes.
float real_distance(vec3 p) {
  if (in_cascade(0, p, 0.5)) return textureLod(real_distance_0, cascade_uvw(0, p), 0.0).r;
  if (in_cascade(1, p, 0.5)) return textureLod(real_distance_1, cascade_uvw(1, p), 0.0).r;
  return kFar;
}

// Weighted mean over a footprint of the given radius; premultiplied.
#define FOOTPRINT(name, tex0, tex1)                                                                     \
  vec4 name(vec3 p, float radius, float up) {                                                           \
    int c = in_cascade(0, p, 0.5) ? 0 : 1;                                                              \
    float lod = max(log2(max(2.0 * radius, 1e-6) / frame.cascade[c].w), 0.0) + up;                      \
    vec3 at = cascade_uvw(c, p);                                                                        \
    return c == 0 ? textureLod(tex0, at, lod) : textureLod(tex1, at, lod);                              \
  }
FOOTPRINT(real_footprint, real_radiance_0, real_radiance_1)
FOOTPRINT(virtual_footprint, virtual_radiance_0, virtual_radiance_1)
FOOTPRINT(change_footprint, real_change_0, real_change_1)

const float kLeastWeight = 1e-3;
vec3 real_radiance(vec3 p, float radius) {
  vec4 s = real_footprint(p, radius, 0.0);
  if (s.a < kLeastWeight) s = real_footprint(p, radius, 1.5);
  return s.a < kLeastWeight ? vec3(0) : s.rgb / s.a;
}
vec3 virtual_radiance(vec3 p, float radius) {
  vec4 s = virtual_footprint(p, radius, 0.0);
  if (s.a < kLeastWeight) s = virtual_footprint(p, radius, 1.5);
  return s.a < kLeastWeight ? vec3(0) : s.rgb / s.a;
}
vec3 real_change(vec3 p, float radius) {
  vec4 s = change_footprint(p, radius, 0.0);
  return s.a < kLeastWeight ? vec3(0) : s.rgb / s.a;
}

// Equal-area octahedral map of the sphere (Clarberg 2008, "Fast Equal-Area Mapping of the (Hemi)Sphere").
vec2 octahedral(vec3 w) {
  vec3 a = abs(w);
  float r = sqrt(max(1.0 - a.z, 0.0));
  float phi = atan(a.y, max(a.x, 1e-12)) * (2.0 / kPi);
  vec2 uv = vec2(r - phi * r, phi * r);
  if (w.z < 0.0) uv = 1.0 - uv.yx;
  return 0.5 + 0.5 * uv * vec2(w.x < 0.0 ? -1.0 : 1.0, w.y < 0.0 ? -1.0 : 1.0);
}

// Radiance from beyond everything known, mean over a cone.
vec3 environment_radiance(vec3 w, float tan_half) {
  // A cone of half angle a covers 2π(1 - cos a); a texel of level 0 covers 4π / size².
  float size = float(textureSize(environment, 0).x);
  float c = inversesqrt(1.0 + tan_half * tan_half);
  float lod = 0.5 * log2(max(0.5 * (1.0 - c), 1e-9) * size * size);
  return textureLod(environment, octahedral(w), clamp(lod, 0.0, float(frame.counts2.y - 1))).rgb;
}
#endif
