// Splits values over the 8 nearest voxels of both cascades, in fixed point: integer sums do not depend on their order.
#ifndef SPLAT_GLSL
#define SPLAT_GLSL
#include "volume/chunks.glsl"

struct Splat {
  bool inside;
  int cascade;
  ivec3 first;  // the lowest voxel
  vec3 f;
};
// `ahead`: offset in voxels.
Splat splat_at(int c, vec3 p, vec3 ahead) {
  int n = frame.grid.x;
  vec3 g = (p - frame.cascade[c].xyz) / frame.cascade[c].w + ahead;
  ivec3 base = ivec3(floor(g));
  Splat s;
  s.inside = all(greaterThanEqual(base, ivec3(0))) && all(lessThan(base, ivec3(n - 1)));
  s.cascade = c;
  s.first = base;
  s.f = g - vec3(base);
  return s;
}
// As voxel_value(); values for chunk 0 are dropped.
uint splat_voxel(int kind, Splat s, int i) {
  return voxel_value(kind, s.cascade, s.first + ivec3(i & 1, i >> 1 & 1, i >> 2));
}
bool is_kept(uint value) { return value >= 512u; }
float splat_weight(Splat s, int i) {
  vec3 w = mix(1.0 - s.f, s.f, vec3(i & 1, (i >> 1) & 1, i >> 2));
  return w.x * w.y * w.z;
}
#endif
