#version 460
#extension GL_GOOGLE_include_directive : require
// Indirect change T_delta_2 (thesis eq. 5.21) as irradiance, at 1/scale of the image and only inside the influence
// mask. a: index of the represented pixel in the block, plus 1; 0: none.
#include "volume/gather.glsl"
#include "common/half.glsl"
#include "common/tiles.glsl"
#include "common/material_mask.glsl"
#include "screen/real_in_front.glsl"
layout(binding = 12) uniform sampler2D real_position;
layout(binding = 13) uniform sampler2D real_normal;
layout(binding = 14) uniform sampler2D object_surface;
layout(binding = 15) uniform sampler2D real_albedo;
layout(binding = 16, rgba16f) uniform writeonly image2D out_change;

void main() {
  int scale = frame.picture.z;
  ivec2 at = tile_texel(), size = imageSize(out_change);
  if (any(greaterThanEqual(at, size))) return;
  vec4 result = vec4(0);
  // The first pixel, starting at the block's centre, that the objects can change.
  for (int i = 0; i < scale * scale; ++i) {
    int j = (i + scale * (scale / 2) + scale / 2) % (scale * scale);
    ivec2 q = min(scale * at + ivec2(j % scale, j / scale), frame.picture.xy - 1);
    vec4 normal = texelFetch(real_normal, q, 0);
    vec4 real = texelFetch(real_position, q, 0);
    if (normal.a == 0.0 || !shows_room(texelFetch(object_surface, q, 0), real.a)) continue;
    if (is_metal(texelFetch(real_albedo, q, 0).a)) continue;
    vec3 p = real.xyz, n = normalize(normal.xyz);
    vec3 off = p + cone_start_m() * n;
    float turn = pixel_turn(at);
    vec3 gained, lost;
    gather_delta(p, off, n, frame.counts.y, turn, gained, lost);
    result = vec4(gained - lost + gather_change(off, p, n, frame.pass_i.x, turn), float(j + 1));
    break;
  }
  imageStore(out_change, at, to_half(result));
}
