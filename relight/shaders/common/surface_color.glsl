// Base colour of a virtual surface: factor, vertex colour, texture.
#include "common/interop.h"
#include "common/srgb.glsl"
layout(std140, binding = 0) uniform Draw { DrawParams draw; };
layout(binding = 1) uniform sampler2D base_color_texture;  // 8-bit sRGB

vec3 surface_color(vec2 uv, vec3 tint) {
  vec3 base = draw.base_color.rgb * mix(vec3(1), tint, draw.tint.x);
  if (draw.base_color.a > 0.0) base *= srgb_decode(texture(base_color_texture, fract(uv)).rgb);
  return base;
}
