// Looking up what points of lamps see of the objects (passes/lamp_maps.h).
#ifndef LAMP_MAPS_GLSL
#define LAMP_MAPS_GLSL
#include "lamp.glsl"
layout(binding = 7) uniform sampler2D lamp_depths;
layout(std430, binding = 8) readonly buffer LampViews { LampMap lamp_views[]; };

// How far in front of a real surface the objects must be to hide it.
const float kBefore_m = 5e-4;
const float kClear_m = 1e-3, kClearTexels = 1.5;

// What a map's point stands for, one of n of its lamp.
LampSample map_share(Lamp lamp, LampMap m, vec3 p, int n) {
  vec3 to = m.from.xyz - p;
  LampSample s;
  s.distance = length(to);
  s.w = to / s.distance;
  s.tan_half = min(kLampShare * inversesqrt(float(n)) * lamp.position_radius.w / s.distance, 0.3);
  s.irradiance = lamp.intensity.rgb * emission(lamp, -s.w) / (float(n) * s.distance * s.distance);
  return s;
}

// Which part of a texel's width around p the objects hide from a map's point: 2 × 2 comparisons, weighed by their share
// (Reeves et al. 1987). before_m: how far in front of p they must be.
float map_hidden(LampMap m, vec3 p, float before_m) {
  vec3 d = p - m.from.xyz, v = vec3(dot(m.x.xyz, d), dot(m.y.xyz, d), dot(m.z.xyz, d));
  if (v.z <= before_m || any(greaterThan(abs(v.xy), v.zz))) return 0.0;
  vec2 at = (0.5 + 0.5 * v.xy / v.z) * m.more.x - 0.5;
  float depth = min(m.place.z - m.place.w / (v.z - before_m), 1.0);  // empty texels are at 1
  ivec2 low = ivec2(floor(at)), last = ivec2(m.more.x) - 1, place = ivec2(m.place.xy);
  vec2 f = at - vec2(low);
  vec4 behind;
  for (int i = 0; i < 4; ++i) {
    ivec2 q = clamp(low + ivec2(i & 1, i >> 1), ivec2(0), last);
    behind[i] = texelFetch(lamp_depths, place + q, 0).r < depth ? 1.0 : 0.0;
  }
  return mix(mix(behind.x, behind.y, f.x), mix(behind.z, behind.w, f.x), f.y);
}

// The share of a lamp's light that reaches a virtual surface past the objects. It starts so far off the surface that the
// texels in which maps hold it, and the simpler triangles that they are drawn from, do not hide it from itself.
float map_open(int first, int count, vec3 p, vec3 n) {
  vec3 off = p + (kClear_m + kClearTexels * lamp_views[first].more.y) * n;
  float open = 0.0, all = 1e-6;
  for (int i = first; i < first + count; ++i) {
    float cosine = max(dot(n, normalize(lamp_views[i].from.xyz - p)), 0.0);
    open += cosine * (1.0 - map_hidden(lamp_views[i], off, kBefore_m));
    all += cosine;
  }
  return open / all;
}
#endif
