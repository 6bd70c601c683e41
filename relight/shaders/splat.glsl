// Splitting over the 8 nearest voxels of both cascades, in fixed point: integer sums do not depend on their order.
#ifndef SPLAT_GLSL
#define SPLAT_GLSL
#include "frame.glsl"

struct Splat {
  bool inside;
  int first;  // index of the lowest voxel in a buffer of both cascades
  vec3 f;
};
// `ahead` in voxels.
Splat splat_at(int c, vec3 p, vec3 ahead) {
  int n = frame.grid.x;
  vec3 g = (p - frame.cascade[c].xyz) / frame.cascade[c].w + ahead;
  ivec3 base = ivec3(floor(g));
  Splat s;
  s.inside = all(greaterThanEqual(base, ivec3(0))) && all(lessThan(base, ivec3(n - 1)));
  s.first = base.x + n * (base.y + n * (base.z + n * c));
  s.f = g - vec3(base);
  return s;
}
int splat_voxel(Splat s, int i) {
  int n = frame.grid.x;
  return s.first + (i & 1) + n * ((i >> 1) & 1) + n * n * (i >> 2);
}
float splat_weight(Splat s, int i) {
  vec3 w = mix(1.0 - s.f, s.f, vec3(i & 1, (i >> 1) & 1, i >> 2));
  return w.x * w.y * w.z;
}
#endif
