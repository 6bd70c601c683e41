#version 460
#extension GL_GOOGLE_include_directive : require
// Visible samples of virtual objects at a pixel, in front of the real surface (thesis §5.4.4).
#include "screen/live_real.glsl"
#include "common/half.glsl"
#include "common/tiles.glsl"
#include "screen/real_in_front.glsl"
layout(binding = 11) uniform sampler2D samples;  // radiance; z in the camera frame, 0: nothing
layout(binding = 13, rgba16f) uniform writeonly image2D out_object;  // radiance times coverage, coverage
layout(binding = 14, r32f) uniform writeonly image2D out_z;          // in the camera frame, mean; 0: nothing

void main() {
  ivec2 at = tile_texel();
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  float real = live_place(at).z, measured = texelFetch(depth, at, 0).x;
  vec2 ray = texelFetch(rays, at, 0).xy;
  int s = frame.picture.w;
  vec4 object = vec4(0);
  float z = 0.0;
  for (int i = 0; i < s * s; ++i) {
    vec4 q = texelFetch(samples, s * at + ivec2(i % s, i / s), 0);
    if (q.a == 0.0 || hides(real, measured, q.a, ray)) continue;
    object += vec4(q.rgb, 1.0);
    z += q.a;
  }
  imageStore(out_object, at, to_half(object / float(s * s)));
  imageStore(out_z, at, vec4(z / max(object.a, 1.0)));
}
