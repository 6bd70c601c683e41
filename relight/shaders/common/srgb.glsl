// IEC 61966-2-1, as in capture/camera/srgb.h.
#ifndef SRGB_GLSL
#define SRGB_GLSL
vec3 srgb_encode(vec3 x) {
  x = clamp(x, vec3(0), vec3(1));
  return mix(12.92 * x, 1.055 * pow(max(x, vec3(1e-12)), vec3(1.0 / 2.4)) - 0.055, greaterThan(x, vec3(0.0031308)));
}
vec3 srgb_decode(vec3 c) { return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), greaterThan(c, vec3(0.04045))); }
#endif
