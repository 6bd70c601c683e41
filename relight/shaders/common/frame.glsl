// The uniform block and small geometry functions of all compute passes.
#ifndef FRAME_GLSL
#define FRAME_GLSL
#include "common/interop.h"

layout(std140, binding = 0) uniform Frame { FrameParams frame; };

const float kPi = 3.14159265358979;

// Unit vectors x, y that form a right-handed frame with n (Duff et al. 2017).
void basis(vec3 n, out vec3 x, out vec3 y) {
  float s = n.z >= 0.0 ? 1.0 : -1.0;
  float a = -1.0 / (s + n.z), b = n.x * n.y * a;
  x = vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x);
  y = vec3(b, s + n.y * n.y * a, -n.y);
}

// Offset of cone origins from a real surface, m: nearer than this the volumes and the fused field still contain the
// surface itself.
float cone_start_m() { return max(frame.cascade[0].w, 0.75 * frame.field.x); }

// Intersection of a ray with an axis-aligned box: entry, exit; x > y: none.
vec2 ray_box(vec3 from, vec3 w, vec3 low, vec3 high) {
  vec3 inv = 1.0 / mix(w, vec3(1e-12), lessThan(abs(w), vec3(1e-12)));
  vec3 a = (low - from) * inv, b = (high - from) * inv;
  vec3 lo = min(a, b), hi = max(a, b);
  return vec2(max(max(lo.x, lo.y), lo.z), min(min(hi.x, hi.y), hi.z));
}

// Intersection of a ray with a sphere: entry, exit; x > y: none.
vec2 ray_sphere(vec3 from, vec3 w, vec3 centre, float radius) {
  vec3 d = centre - from;
  float along = dot(d, w), q = radius * radius - dot(d, d) + along * along;
  return q < 0.0 ? vec2(1.0, -1.0) : along + vec2(-1.0, 1.0) * sqrt(q);
}

// Per-pixel rotation of a sampling pattern in [0, 1): interleaved gradient noise (Jimenez 2014).
float pixel_turn(ivec2 p) { return fract(52.9829189 * fract(dot(vec2(p), vec2(0.06711056, 0.00583715)))); }
#endif
