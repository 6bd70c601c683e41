#version 460
#extension GL_GOOGLE_include_directive : require
// The final picture of real surfaces that no object covers, where objects can stand before a lamp. Pixels that nothing
// changes keep their code values.
#include "live_change.glsl"
#include "tiles.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 12, rgba8) uniform writeonly image2D out_picture;

void main() {
  ivec2 at = tile_texel();
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  vec3 code = texelFetch(codes, at, 0).rgb, gain = live_gain(live_real(at, code));
  if (gain != vec3(1)) code = srgb(gain * srgb_linear(code));
  imageStore(out_picture, at, vec4(round(code * 255.0) / 255.0, 1.0));
}
