#version 460
#extension GL_GOOGLE_include_directive : require
// Filters the results of reflect.comp over no more than the blur of the lobe itself: two pixels to either side, fewer
// where the reflected object is near the surface or the surface is polished. Joint bilateral (Kopf et al. 2007), by the
// distance to the pixel's tangent plane and the angle between normals; untraced pixels take their neighbours' mean.
#include "common/brdf.glsl"
#include "screen/mirror_blur.glsl"
#include "common/half.glsl"
#include "common/tiles.glsl"
layout(binding = 12) uniform sampler2D real_position;
layout(binding = 13) uniform sampler2D real_normal;
layout(binding = 14) uniform sampler2D real_albedo;
layout(binding = 15) uniform sampler2D gained;
layout(binding = 17) uniform sampler2D fraction;
layout(binding = 18, rgba16f) uniform writeonly image2D out_gained;
layout(binding = 19, rgba16f) uniform writeonly image2D out_fraction;

const int kWindow = 2;
const float kWidest_px = 1.7;  // sigma of the Gaussian, which falls to a quarter at the window's edge
const float kMin_px = 0.3;

void main() {
  ivec2 at = tile_texel();
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  vec4 normal = texelFetch(real_normal, at, 0), p = texelFetch(real_position, at, 0);
  int known = int(texelFetch(real_albedo, at, 0).a);
  vec4 sum_g = vec4(0), sum_s = vec4(0);
  if (known > 0 && normal.a > 0.0) {
    BsdfParams bsdf = bsdf_of(frame.surfaces[known - 1]);
    float reach = clamp(mirror_blur_px(bsdf.alpha, p.xyz), kMin_px, kWidest_px);
    vec3 n = normalize(normal.xyz);
    float pixel_m = p.a / frame.pinhole.x;
    for (int j = -kWindow; j <= kWindow; ++j) {
      for (int i = -kWindow; i <= kWindow; ++i) {
        ivec2 q = at + ivec2(i, j);
        if (any(lessThan(q, ivec2(0))) || any(greaterThanEqual(q, frame.picture.xy))) continue;
        vec4 g = texelFetch(gained, q, 0);
        if (g.a == 0.0) continue;
        float off = dot(texelFetch(real_position, q, 0).xyz - p.xyz, n) / (2.0 * pixel_m + 0.25 * frame.field.x);
        vec2 apart = vec2(i, j) / reach;
        float turn = max(dot(n, normalize(texelFetch(real_normal, q, 0).xyz)), 0.0);
        float w = exp(-off * off - dot(apart, apart)) * pow(turn, 16.0) + 1e-12;
        sum_g += w * vec4(g.rgb, 1.0);
        sum_s += w * vec4(texelFetch(fraction, q, 0).rgb, 1.0);
      }
    }
  }
  imageStore(out_gained, at, to_half(vec4(sum_g.a > 0.0 ? sum_g.rgb / sum_g.a : vec3(0), 0.0)));
  imageStore(out_fraction, at, to_half(vec4(sum_s.a > 0.0 ? sum_s.rgb / sum_s.a : vec3(0), 0.0)));
}
