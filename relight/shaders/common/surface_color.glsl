// Base colour of a virtual surface: factor, vertex colour, texture.
#include "common/interop.h"
layout(std140, binding = 0) uniform Draw { DrawParams draw; };
layout(binding = 1) uniform sampler2D base_color_texture;  // 8-bit sRGB

vec3 srgb_decode(vec3 c) { return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), greaterThan(c, vec3(0.04045))); }

vec3 surface_color(vec2 uv, vec3 tint) {
  vec3 base = draw.base_color.rgb * mix(vec3(1), tint, draw.tint.x);
  if (draw.base_color.a > 0.0) base *= srgb_decode(texture(base_color_texture, fract(uv)).rgb);
  return base;
}
