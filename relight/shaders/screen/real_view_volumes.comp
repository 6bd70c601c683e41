#version 460
#extension GL_GOOGLE_include_directive : require
// As real_view_bricks.comp, but from the light volumes, and with the indirect change.
#include "screen/real_pixel.glsl"
#include "common/half.glsl"
#include "common/tiles.glsl"
layout(binding = 12, rgba32f) uniform writeonly image2D out_position;  // a: z in the camera frame, 0: unknown
layout(binding = 13, rgba16f) uniform writeonly image2D out_normal;    // a: influence mask, 0 to 1
layout(binding = 14, rgba16f) uniform writeonly image2D out_albedo;    // a: number + 1 of a surface of known material
layout(binding = 15, rgba16f) uniform writeonly image2D out_indirect;

void main() {
  ivec2 at = tile_texel();
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  RealPixel r = real_pixel(at);
  imageStore(out_position, at, vec4(r.p, r.z));
  imageStore(out_normal, at, to_half(vec4(r.n, r.footprint)));
  imageStore(out_albedo, at, to_half(r.albedo));
  imageStore(out_indirect, at, to_half(vec4(r.indirect, 0.0)));
}
