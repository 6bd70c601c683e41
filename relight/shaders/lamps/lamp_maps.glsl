// Look-up in the lamps' shadow maps of the objects, and of what moved in the room (passes/lamps/lamp_maps.h).
#ifndef LAMP_MAPS_GLSL
#define LAMP_MAPS_GLSL
#include "common/lamp.glsl"
layout(binding = 7) uniform sampler2D lamp_depths;
layout(std430, binding = 8) readonly buffer LampViews { LampMap lamp_views[]; };
#include "lamps/lamp_bounds.glsl"
#include "lamps/observed_shadows.glsl"
layout(std430, binding = 11) readonly buffer LampBounds { uint lamp_bounds[]; };

// Minimum distance of the objects in front of a real surface to occlude it.
const float kBefore_m = 5e-4;
const float kClear_m = 1e-3, kClearTexels = 1.5;
const int kSoftTaps = 8;
const float kFurthestTap = 0.97;  // of the disc's radius
const float kMinSoft = 0.7, kMaxSoft = 24.0;  // texels; at most the first: 2 × 2 taps

// Index of a lamp's first map.
int first_map_of(int lamp) {
  int first = 0;
  for (int l = 0; l < lamp; ++l) first += int(frame.lamps[l].intensity.a);
  return first;
}

// The part of its lamp that a map's point represents, one of n.
LampSample map_sample(Lamp lamp, LampMap m, vec3 p, int n) {
  vec3 to = m.from.xyz - p;
  LampSample s;
  s.distance = length(to);
  s.w = to / s.distance;
  s.tan_half = min(kLampConeScale * inversesqrt(float(n)) * lamp.position_radius.w / s.distance, 0.3);
  s.irradiance = lamp.intensity.rgb * emission(lamp, -s.w) / (float(n) * s.distance * s.distance);
  return s;
}

// The depth below which texels occlude a point at z.
float map_threshold(LampMap m, float z) { return min(m.place.z - m.place.w / z, 1.0); }  // empty texels are at 1

// Projects p into a map: texel, z along its axis, and the depth below which texels occlude p. False if p is outside its
// view.
bool map_place(LampMap m, vec3 p, float before_m, out vec2 at, out float z, out float depth) {
  vec3 d = p - m.from.xyz, v = vec3(dot(m.x.xyz, d), dot(m.y.xyz, d), dot(m.z.xyz, d));
  if (v.z <= before_m || any(greaterThan(abs(v.xy), v.zz))) return false;
  at = (0.5 + 0.5 * v.xy / v.z) * m.more.x - 0.5;
  z = v.z;
  depth = map_threshold(m, v.z - before_m);
  return true;
}
float map_depth(LampMap m, ivec2 q) {
  return texelFetch(lamp_depths, ivec2(m.place.xy) + clamp(q, ivec2(0), ivec2(m.more.x) - 1), 0).r;
}

// Fraction of a texel-sized square around a position that is nearer than depth: 2 × 2 comparisons, bilinearly weighted
// (Reeves et al. 1987).
float map_nearer(LampMap m, vec2 at, float depth) {
  vec2 low = clamp(floor(at), vec2(0.0), vec2(m.more.x - 2.0)), f = clamp(at - low, 0.0, 1.0);
  vec2 middle = (m.place.xy + low + 1.0) / vec2(textureSize(lamp_depths, 0));
  vec4 nearer = vec4(lessThan(textureGather(lamp_depths, middle), vec4(depth)));
  return mix(mix(nearer.w, nearer.z, f.x), mix(nearer.x, nearer.y, f.x), f.y);
}

// Radius in texels of the image of a map's part of its lamp, projected through the nearest possible occluder of a point
// at z.
float disc_texels(LampMap m, float z) {
  float nearest = m.place.w / m.place.z;
  return min(m.more.z * (1.0 / min(nearest, z) - 1.0 / z), kMaxSoft);
}

// Result of the block bounds for texels from `from` to `to`, rounded, and depths in a range: 1: every texel is nearer,
// 0: none is, -1: undecided.
float map_bounded(LampMap m, vec2 from, vec2 to, float near, float far) {
  int edge = int(m.more.x);
  ivec2 low = clamp(ivec2(floor(from + 0.5)), ivec2(0), ivec2(edge - 1));
  ivec2 high = clamp(ivec2(floor(to + 0.5)), ivec2(0), ivec2(edge - 1));
  int span = max(high.x - low.x, high.y - low.y), level = span > 16 ? 3 : span > 8 ? 2 : span > 4 ? 1 : 0;
  if (span > kBoundBlock << (kBoundLevels - 1)) return -1.0;
  int shift = kBoundShift + level, blocks = edge >> shift, first = int(m.from.w) + bound_level(edge, level);
  low >>= shift;
  high >>= shift;
  uint a = lamp_bounds[first + low.y * blocks + low.x], b = lamp_bounds[first + low.y * blocks + high.x];
  uint c = lamp_bounds[first + high.y * blocks + low.x], d = lamp_bounds[first + high.y * blocks + high.x];
  if (float(min(min(a >> 16, b >> 16), min(c >> 16, d >> 16))) >= far * kBoundScale) return 0.0;
  return float(max(max(a & 0xffffu, b & 0xffffu), max(c & 0xffffu, d & 0xffffu))) < near * kBoundScale ? 1.0 : -1.0;
}

// Whether the objects occlude p from a map's point. before_m: minimum distance of the occluder in front of p.
float map_hidden(LampMap m, vec3 p, float before_m) {
  vec2 at;
  float z, depth;
  return map_place(m, p, before_m, at, z, depth) ? map_nearer(m, at, depth) : 0.0;
}

// Whether what moved in the room since it was fused occludes p from a map's point, by more than before_m in front of it.
float moved_hidden(LampMap m, vec3 p, float before_m) {
  vec2 at;
  float z, depth;
  if (m.x.w <= 0.0 || !map_place(m, p, before_m, at, z, depth)) return 0.0;
  LampMap below = m;
  below.place.y += m.y.w;
  return map_nearer(below, at, 1.0 - m.x.w / (z - before_m));
}

// Fraction of a lamp's light that it lets pass to p.
float moved_open(int first, int count, vec3 p, float before_m) {
  float hidden = 0.0;
  for (int i = first; i < first + count && lamp_views[i].x.w > 0.0; ++i)
    hidden += moved_hidden(lamp_views[i], p, before_m);
  return 1.0 - hidden / max(float(count), 1.0);
}

// Rotation from one point of a sunflower spiral (Vogel 1979) to the next.
const vec2 kGoldenTurn = vec2(-0.73736888, 0.67549029);  // cos, sin of the golden angle
vec2 turned(vec2 q, vec2 turn) { return vec2(turn.x * q.x - turn.y * q.y, turn.y * q.x + turn.x * q.y); }
float leaf(int i) { return sqrt((float(i) + 0.5) / float(kSoftTaps)); }

// Fraction of a map's part of its lamp, a disc, that the objects occlude at p: comparisons over the disc's image
// through the occluder, whose mean distance is first estimated by 8 of them (Fernando 2005).
float disc_hidden(LampMap m, vec3 p, float before_m) {
  vec2 at;
  float z, depth;
  bool seen = map_place(m, p, before_m, at, z, depth);
  float radius = disc_texels(m, z), reach = max(kFurthestTap * radius, 0.5);
  // Software devices execute both sides of a branch but leave loops early.
  float bounded = seen ? map_bounded(m, at - reach, at + reach, depth, depth) : 0.0;
  bool small = radius < kMinSoft;
  vec2 turn = vec2(cos(m.more.w), sin(m.more.w));
  float found = 0.0, way = 0.0;
  int taps = bounded >= 0.0 || small ? 0 : kSoftTaps;
  vec2 way_out = turn;
  for (int i = 0; i < taps; ++i) {
    float d = map_depth(m, ivec2(round(at + radius * leaf(i) * way_out)));
    way_out = turned(way_out, kGoldenTurn);
    bool nearer = d < depth;
    found += nearer ? 1.0 : 0.0;
    way += nearer ? (m.place.z - d) / m.place.w : 0.0;  // 1 / z
  }
  if (found > 0.0) radius = min(m.more.z * (way / found - 1.0 / z), radius);
  small = small || radius < kMinSoft;
  taps = found == 0.0 || small ? 0 : kSoftTaps;
  float hidden = 0.0;
  way_out = turn;
  for (int i = 0; i < taps; ++i) {
    hidden += map_depth(m, ivec2(round(at + radius * leaf(i) * way_out))) < depth ? 1.0 : 0.0;
    way_out = turned(way_out, kGoldenTurn);
  }
  if (bounded >= 0.0) return bounded;
  return small ? map_nearer(m, at, depth) : hidden / float(kSoftTaps);
}

// Fraction of a lamp's light that neither objects nor what moved occlude at a virtual surface. The look-up is offset
// from the surface far enough that neither the maps' resolution nor the simplified meshes drawn into them cause
// self-shadowing.
float map_open(int first, int count, vec3 p, vec3 n) {
  vec3 off = p + (kClear_m + kClearTexels * lamp_views[first].more.y) * n;
  float open = 0.0, all = 1e-6;
  for (int i = first; i < first + count; ++i) {
    float cosine = max(dot(n, normalize(lamp_views[i].from.xyz - p)), 0.0);
    open += cosine * (1.0 - map_hidden(lamp_views[i], off, kBefore_m)) * (1.0 - moved_hidden(lamp_views[i], off, kBefore_m));
    all += cosine;
  }
  return open / all;
}
#endif
