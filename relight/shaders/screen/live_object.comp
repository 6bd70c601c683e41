#version 460
#extension GL_GOOGLE_include_directive : require
// Visible samples of virtual objects at a pixel, in front of the real surface (thesis §5.4.4).
#include "screen/live_real.glsl"
#include "common/half.glsl"
#include "common/tiles.glsl"
layout(binding = 11) uniform sampler2D samples;  // radiance; z in the camera frame, 0: nothing
layout(binding = 13, rgba16f) uniform writeonly image2D out_object;  // radiance times coverage, coverage

void main() {
  ivec2 at = tile_texel();
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  float z = live_place(at).z;
  // Contact tolerance: an object standing on a real surface must not be cut by that surface's depth error.
  float behind = z > 0.0 ? z + max(0.3 * frame.field.x, 0.003 * z) : 1e9;
  int s = frame.picture.w;
  vec4 object = vec4(0);
  for (int i = 0; i < s * s; ++i) {
    vec4 q = texelFetch(samples, s * at + ivec2(i % s, i / s), 0);
    if (q.a == 0.0 || q.a > behind) continue;
    object += vec4(q.rgb, 1.0);
  }
  imageStore(out_object, at, to_half(object / float(s * s)));
}
