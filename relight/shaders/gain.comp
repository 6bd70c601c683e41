#version 460
#extension GL_GOOGLE_include_directive : require
// Where indirect light alone changes: the factor by which it changes the radiance of real surfaces, for one pixel of every
// pass_i.x along each axis. It is smoother than the picture, whose own detail it multiplies.
#include "real_pixel.glsl"
#include "half.glsl"
#include "tiles.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 12, rgba16f) uniform writeonly image2D out_gain;

void main() {
  ivec2 cell = tile_texel(), at = frame.pass_i.x * cell;
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  RealPixel r = real_pixel(at);
  vec3 b = max(texelFetch(radiance, at, 0).rgb, vec3(1e-5));
  vec3 gain = max(1.0 + r.footprint / kPi * r.albedo.rgb * r.indirect / b, vec3(0));
  if (any(isnan(gain)) || any(isinf(gain))) gain = vec3(1);
  imageStore(out_gain, cell, to_half(vec4(gain, 1.0)));
}
