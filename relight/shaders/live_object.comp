#version 460
#extension GL_GOOGLE_include_directive : require
// The final picture where virtual objects may show (thesis §5.4.4): real surfaces as in live_shadow.comp, and in front of
// them the samples of the objects, which hold radiance.
#include "live_change.glsl"
#include "tiles.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 11) uniform sampler2D samples;  // radiance; z in the camera, 0: nothing
layout(binding = 12, rgba8) uniform writeonly image2D out_picture;

void main() {
  ivec2 at = tile_texel();
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  vec3 code = texelFetch(codes, at, 0).rgb;
  LiveReal r = live_real(at, code);
  vec3 gain = live_gain(r);
  // Contact: an object that stands on a real surface is not cut by that surface's own error.
  float behind = r.z > 0.0 ? r.z + max(0.3 * frame.field.x, 0.003 * r.z) : 1e9;
  int s = frame.picture.w, covered = 0;
  vec3 object = vec3(0);
  for (int i = 0; i < s * s; ++i) {
    vec4 q = texelFetch(samples, s * at + ivec2(i % s, i / s), 0);
    if (q.a == 0.0 || q.a > behind) continue;
    ++covered;
    object += q.rgb;
  }
  if (covered > 0 || gain != vec3(1)) {
    float share = float(covered) / float(s * s);
    code = srgb((1.0 - share) * gain * srgb_linear(code) + frame.camera.y / float(s * s) * object);
  }
  imageStore(out_picture, at, vec4(round(code * 255.0) / 255.0, 1.0));
}
