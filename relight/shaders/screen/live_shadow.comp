#version 460
#extension GL_GOOGLE_include_directive : require
// Factor of the radiance of real surfaces where objects may occlude a lamp: for one of pass_i.x pixels along each axis.
#include "screen/live_real.glsl"
#include "screen/lamp_shadow.glsl"
#include "common/half.glsl"
#include "common/tiles.glsl"
layout(binding = 12, rgba16f) uniform writeonly image2D out_gain;

void main() {
  ivec2 cell = tile_texel(), at = frame.pass_i.x * cell;
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  LiveReal r = live_real(at, texelFetch(codes, at, 0).rgb);
  vec3 gain = bounded_gain(1.0 + r.response * (r.indirect - lamps_lost(r)));
  imageStore(out_gain, cell, to_half(vec4(gain, 1.0)));
}
