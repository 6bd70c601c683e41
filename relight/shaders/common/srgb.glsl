// IEC 61966-2-1.
#ifndef SRGB_GLSL
#define SRGB_GLSL
vec3 srgb(vec3 x) {
  x = clamp(x, vec3(0), vec3(1));
  return mix(12.92 * x, 1.055 * pow(max(x, vec3(1e-12)), vec3(1.0 / 2.4)) - 0.055, greaterThan(x, vec3(0.0031308)));
}
#endif
