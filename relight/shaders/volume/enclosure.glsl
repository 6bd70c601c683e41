// Points of the enclosure, one per texel of its octahedral maps.
#ifndef ENCLOSURE_GLSL
#define ENCLOSURE_GLSL
#include "volume/gather.glsl"

// The inverse of octahedral().
vec3 octahedral_direction(vec2 uv) {
  vec2 q = 2.0 * uv - 1.0, a = abs(q);
  float signed_distance = 1.0 - (a.x + a.y), r = 1.0 - abs(signed_distance);
  float phi = (r == 0.0 ? 1.0 : (a.y - a.x) / r + 1.0) * kPi / 4.0;
  float z = 1.0 - r * r, s = r * sqrt(max(2.0 - r * r, 0.0));
  return vec3(vec2(cos(phi), sin(phi)) * s * mix(vec2(1), vec2(-1), lessThan(q, vec2(0))), signed_distance < 0.0 ? -z : z);
}

// False where no side closes the enclosure.
bool enclosure_point(ivec2 at, ivec2 size, out vec3 p, out vec3 n) {
  vec3 w = octahedral_direction((vec2(at) + 0.5) / vec2(size));
  int side;
  float t = leave(frame.enclosure.xyz, w, side);
  p = frame.enclosure.xyz + t * w;
  n = frame.sides[max(side, 0)].xyz;
  return side >= 0;
}
#endif
