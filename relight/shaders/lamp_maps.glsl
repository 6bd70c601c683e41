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

// Where a map sees p: texel, z along its axis, and the depth before which texels hide it. False where it sees nothing.
bool map_place(LampMap m, vec3 p, float before_m, out vec2 at, out float z, out float depth) {
  vec3 d = p - m.from.xyz, v = vec3(dot(m.x.xyz, d), dot(m.y.xyz, d), dot(m.z.xyz, d));
  if (v.z <= before_m || any(greaterThan(abs(v.xy), v.zz))) return false;
  at = (0.5 + 0.5 * v.xy / v.z) * m.more.x - 0.5;
  z = v.z;
  depth = min(m.place.z - m.place.w / (v.z - before_m), 1.0);  // empty texels are at 1
  return true;
}
float map_depth(LampMap m, ivec2 q) {
  return texelFetch(lamp_depths, ivec2(m.place.xy) + clamp(q, ivec2(0), ivec2(m.more.x) - 1), 0).r;
}

// Which part of a texel's width around a place is nearer than depth: 2 × 2 comparisons, weighed by their share (Reeves
// et al. 1987).
float map_nearer(LampMap m, vec2 at, float depth) {
  vec2 low = clamp(floor(at), vec2(0.0), vec2(m.more.x - 2.0)), f = clamp(at - low, 0.0, 1.0);
  vec2 middle = (m.place.xy + low + 1.0) / vec2(textureSize(lamp_depths, 0));
  vec4 nearer = vec4(lessThan(textureGather(lamp_depths, middle), vec4(depth)));
  return mix(mix(nearer.w, nearer.z, f.x), mix(nearer.x, nearer.y, f.x), f.y);
}

// Whether the objects hide p from a map's point. before_m: how far in front of p they must be.
float map_hidden(LampMap m, vec3 p, float before_m) {
  vec2 at;
  float z, depth;
  return map_place(m, p, before_m, at, z, depth) ? map_nearer(m, at, depth) : 0.0;
}

const int kSoftTaps = 8;
const float kLeastSoft = 0.7, kMostSoft = 24.0;  // texels; a disc no larger than the first is 2 × 2 comparisons

// A sunflower (Vogel 1979), turned otherwise in every map.
vec2 soft_tap(int i, vec2 turn) {
  float phi = 2.39996323 * float(i), r = sqrt((float(i) + 0.5) / float(kSoftTaps));
  vec2 q = r * vec2(cos(phi), sin(phi));
  return vec2(turn.x * q.x - turn.y * q.y, turn.y * q.x + turn.x * q.y);
}

// Which part of a map's share of its lamp, a disc, the objects hide from p: comparisons over the disc's image through
// what hides it, whose mean distance 8 of them find first (Fernando 2005).
float share_hidden(LampMap m, vec3 p, float before_m) {
  vec2 at;
  float z, depth;
  if (!map_place(m, p, before_m, at, z, depth)) return 0.0;
  float nearest = m.place.w / m.place.z, radius = min(m.more.z * (1.0 / min(nearest, z) - 1.0 / z), kMostSoft);
  if (radius < kLeastSoft) return map_nearer(m, at, depth);
  vec2 turn = vec2(cos(m.more.w), sin(m.more.w));
  float found = 0.0, way = 0.0;
  for (int i = 0; i < kSoftTaps; ++i) {
    float d = map_depth(m, ivec2(round(at + radius * soft_tap(i, turn))));
    if (d >= depth) continue;
    found += 1.0;
    way += (m.place.z - d) / m.place.w;  // 1 / z
  }
  if (found == 0.0) return 0.0;
  radius = min(m.more.z * (way / found - 1.0 / z), radius);
  if (radius < kLeastSoft) return map_nearer(m, at, depth);
  float hidden = 0.0;
  for (int i = 0; i < kSoftTaps; ++i) {
    hidden += map_depth(m, ivec2(round(at + radius * soft_tap(i, turn)))) < depth ? 1.0 : 0.0;
  }
  return hidden / float(kSoftTaps);
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
