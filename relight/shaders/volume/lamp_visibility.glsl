// Light of a lamp that arrives at a surface.
#ifndef LAMP_OPEN_GLSL
#define LAMP_OPEN_GLSL
#include "volume/cone.glsl"
#include "common/lamp.glsl"

// Fraction of a whole lamp, seen from the cone's origin, that real surfaces do not occlude; `asked` false: not evaluated,
// as the result is unused.
float lamp_open(Cone k, Lamp lamp, bool asked) {
  vec3 to = lamp.position_radius.xyz - k.from_virtual;
  float far = length(to);
  k.w = to / far;
  k.tan_half = lamp.position_radius.w / far;
  return 1.0 - real_shadow(k, asked ? far : 0.0);
}

// At a virtual surface: visibility by shadow cones through real surfaces, and through virtual ones if there are no shadow maps, for every
// stride-th sample of the lamp, beginning with `first`. x: irradiance per intensity, 1/m²; y: the unoccluded fraction
// of the light.
vec2 lamp_visibility(vec3 p, vec3 n, vec3 from_real, vec3 from_virtual, Lamp lamp, int first, int stride) {
  float open = 0.0, all = 0.0, irradiance = 0.0;
  Cone k;
  k.from_real = from_real;
  k.from_virtual = from_virtual;
  for (int i = first; i < frame.counts.w; i += stride) {
    LampSample s = lamp_sample(lamp, p, i, frame.counts.w);
    float cosine = dot(n, s.w);
    if (cosine <= 0.0) continue;
    k.w = s.w;
    k.tan_half = s.tan_half;
    float passed = lamp.intensity.a > 0.0 ? 1.0 : 1.0 - virtual_shadow(k, s.distance);
    passed *= 1.0 - real_shadow(k, passed > 0.005 ? s.distance : 0.0);
    open += cosine * passed;
    all += cosine;
    irradiance += emission(lamp, -s.w) * cosine * passed / (s.distance * s.distance);
  }
  return vec2(irradiance * float(stride) / float(frame.counts.w), all > 0.0 ? open / all : 0.0);
}
#endif
