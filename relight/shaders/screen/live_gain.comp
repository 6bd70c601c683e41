#version 460
#extension GL_GOOGLE_include_directive : require
// Where only indirect light changes: the factor of the real surfaces' radiance, for one of pass_i.x pixels along each
// axis. It varies more slowly than the image, whose detail it multiplies. Stored to the power of 1 / 2.4: above its
// linear part the sRGB curve is code = 1.055 x^(1/2.4) - 0.055, so a factor on x becomes a factor on code + 0.055.
#include "screen/live_real.glsl"
#include "common/half.glsl"
#include "common/tiles.glsl"
layout(binding = 12, rgba16f) uniform writeonly image2D out_gain;

void main() {
  ivec2 cell = tile_texel(), at = frame.pass_i.x * cell;
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  LiveReal r = live_real(at, texelFetch(codes, at, 0).rgb);
  vec3 gain = bounded_gain(1.0 + r.response * r.indirect);
  imageStore(out_gain, cell, to_half(vec4(pow(gain, vec3(1.0 / 2.4)), 1.0)));
}
