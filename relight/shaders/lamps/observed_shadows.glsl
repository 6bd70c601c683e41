// Look-up in the shadows of what moved that the colour camera sees (passes/lamps/observed_shadows.h).
#ifndef OBSERVED_SHADOWS_GLSL
#define OBSERVED_SHADOWS_GLSL
#include "common/frame.glsl"
layout(std430, binding = 35) readonly buffer ObservedShadows {
  ObservedShadow observed[kMaxLamps];
  float observed_open[];
};

// As LampProjection and LampShadow::open_at.
const float kMaxSlope = 3.0;
float observed_value(ObservedShadow s, ivec2 cell) {
  bool inside = all(greaterThanEqual(cell, ivec2(0))) && all(lessThan(cell, s.cells.xy));
  return inside ? observed_open[s.cells.z + cell.y * s.cells.x + cell.x] : 1.0;
}
float observed_at(ObservedShadow s, vec3 p) {
  vec3 d = p - s.origin.xyz, at = vec3(dot(s.x.xyz, d), dot(s.y.xyz, d), dot(s.z.xyz, d));
  bool parallel = s.origin.a > 0.0;
  if (!parallel && (at.z <= 0.0 || max(abs(at.x), abs(at.y)) > kMaxSlope * at.z)) return 1.0;
  vec2 q = ((parallel ? at.xy : at.xy / at.z) - s.place.xy) / s.place.z;
  if (any(lessThan(q, vec2(-1.0))) || any(greaterThan(q, vec2(s.cells.xy)))) return 1.0;
  ivec2 cell = ivec2(floor(q));
  vec2 f = q - floor(q);
  return mix(mix(observed_value(s, cell), observed_value(s, cell + ivec2(1, 0)), f.x),
             mix(observed_value(s, cell + ivec2(0, 1)), observed_value(s, cell + ivec2(1, 1)), f.x), f.y);
}

// Fraction of a lamp's light that arrives at p past what moved.
float shadow_open(int lamp, vec3 p) {
  float open = 1.0;
  // A loop that is not entered costs nothing on software devices, unlike a branch.
  for (int i = 0; i < (frame.observed.x > 0 ? observed[lamp].cells.x > 0 ? 1 : 0 : 0); ++i) open = observed_at(observed[lamp], p);
  return open;
}
#endif
