// Light of objects that emit, at surfaces outside the volumes.
#ifndef EMISSION_BEYOND_GLSL
#define EMISSION_BEYOND_GLSL
#include "volume/volume.glsl"

// `inside`: the change of irradiance by the volumes. Outside them that of a small lamp in the middle of the objects,
// without shadows; in between a mixture.
vec3 with_emission_beyond(vec3 inside, vec3 p, vec3 n) {
  if (frame.emission.rgb == vec3(0)) return inside;
  vec3 to = frame.sphere.xyz - p;
  float far2 = max(dot(to, to), frame.sphere.w * frame.sphere.w);
  return mix(frame.emission.rgb * max(dot(n, to), 0.0) / (far2 * sqrt(far2)), inside, edge_fade(p));
}
#endif
