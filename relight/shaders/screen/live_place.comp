#version 460
#extension GL_GOOGLE_include_directive : require
// Position of the real surface behind virtual objects, for the depth test of their samples.
#include "screen/live_real.glsl"
#include "common/tiles.glsl"
layout(binding = 12, rgba32f) uniform writeonly image2D out_position;  // a: z in the camera, 0: unknown

void main() {
  ivec2 at = tile_texel();
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  LivePlace real = live_place(at);
  imageStore(out_position, at, vec4(real.p, real.z));
}
