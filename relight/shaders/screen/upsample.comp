#version 460
#extension GL_GOOGLE_include_directive : require
// Joint bilateral filter and upsampling (Kopf et al. 2007): traced values of pixels on the same surface, weighted by
// the distance to this pixel's tangent plane and the angle between normals. The window covers the whole sampling
// pattern of neighbouring pixels, so the pattern is not visible.
#include "common/frame.glsl"
#include "common/half.glsl"
#include "common/tiles.glsl"
layout(binding = 12) uniform sampler2D real_position;
layout(binding = 13) uniform sampler2D real_normal;
layout(binding = 14) uniform sampler2D traced;
layout(binding = 16, rgba16f) uniform writeonly image2D out_change;

void main() {
  ivec2 at = tile_texel();
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  int scale = frame.picture.z;
  vec4 normal = texelFetch(real_normal, at, 0);
  vec3 sum = vec3(0);
  float weights = 0.0;
  if (normal.a > 0.0) {
    vec4 p = texelFetch(real_position, at, 0);
    vec3 n = normalize(normal.xyz);
    float pixel_m = abs(p.a) / frame.pinhole.x;  // at this depth
    float reach = frame.pass_f.x * float(scale);
    ivec2 middle = at / scale, size = textureSize(traced, 0);
    int window = frame.pass_i.x;
    // In small windows mostly nothing changes. A loop that is not entered costs nothing on software devices, unlike a
    // branch.
    vec3 low = vec3(1e9), high = vec3(-1e9);
    for (int i = 0; i < (window == 1 ? 9 : 0); ++i) {
      ivec2 q = clamp(middle + ivec2(i % 3, i / 3) - 1, ivec2(0), size - 1);
      vec4 s = texelFetch(traced, q, 0);
      if (s.a == 0.0) continue;
      low = min(low, s.rgb);
      high = max(high, s.rgb);
    }
    bool even = low == high;
    if (even) {
      sum = low;
      weights = 1.0;
    }
    for (int j = -window; j <= (even ? -window - 1 : window); ++j) {
      for (int i = -window; i <= window; ++i) {
        ivec2 q = middle + ivec2(i, j);
        if (any(lessThan(q, ivec2(0))) || any(greaterThanEqual(q, size))) continue;
        vec4 s = texelFetch(traced, q, 0);
        if (s.a == 0.0) continue;
        int block = int(s.a) - 1;
        ivec2 from = min(scale * q + ivec2(block % scale, block / scale), frame.picture.xy - 1);
        vec4 m = texelFetch(real_normal, from, 0);
        vec3 to = texelFetch(real_position, from, 0).xyz - p.xyz;
        float off = dot(to, n) / (2.0 * pixel_m * float(scale) + 0.25 * frame.field.x);
        vec2 apart = vec2(from - at) / reach;
        float turn = max(dot(n, normalize(m.xyz)), 0.0);
        float w = exp(-off * off - dot(apart, apart)) * pow(turn, 16.0) + 1e-8;
        sum += w * s.rgb;
        weights += w;
      }
    }
  }
  imageStore(out_change, at, to_half(vec4(weights > 0.0 ? sum / weights : vec3(0), 0.0)));
}
