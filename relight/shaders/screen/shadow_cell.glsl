// Cells of the shadow passes: blocks of pass_i.x × pass_i.x pixels, each represented by one pixel.
#ifndef SHADOW_CELL_GLSL
#define SHADOW_CELL_GLSL
#include "volume/lamp_visibility.glsl"
#include "screen/real_in_front.glsl"
layout(binding = 12) uniform sampler2D real_position;
layout(binding = 13) uniform sampler2D real_normal;
layout(binding = 15) uniform sampler2D object_surface;

// The first pixel of the block that the objects can change; -1: none.
int shadow_pixel(ivec2 cell, out ivec2 at, out vec3 n) {
  int scale = frame.pass_i.x;
  for (int i = 0; i < scale * scale; ++i) {
    at = min(scale * cell + ivec2(i % scale, i / scale), frame.picture.xy - 1);
    vec4 normal = texelFetch(real_normal, at, 0);
    n = normalize(normal.xyz);
    float real = texelFetch(real_position, at, 0).a;
    if (normal.a > 0.0 && shows_room(texelFetch(object_surface, at, 0), real)) return i;
  }
  return -1;
}
#endif
