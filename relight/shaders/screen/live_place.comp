#version 460
#extension GL_GOOGLE_include_directive : require
// Where the real surface is behind virtual objects, so that their samples can be told in front of it from behind.
#include "screen/live_real.glsl"
#include "common/tiles.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 12, rgba32f) uniform writeonly image2D out_position;  // a: z in the camera, 0: unknown

void main() {
  ivec2 at = tile_texel();
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  LivePlace real = live_place(at);
  imageStore(out_position, at, vec4(real.p, real.z));
}
