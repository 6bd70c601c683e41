#version 460
#extension GL_GOOGLE_include_directive : require
// Change of the specular part of real surfaces of known material (thesis eq. 5.22, §5.4.2): the reflection of virtual
// surfaces, and the fraction of the previous reflection that they occlude. Most of what a camera sees in a real mirror
// was never reconstructed, so the occluded fraction is subtracted from the camera image itself.
#include "volume/cone.glsl"
#include "screen/mirror_blur.glsl"
#include "common/half.glsl"
#include "common/tiles.glsl"
#include "screen/real_in_front.glsl"
layout(binding = 12) uniform sampler2D real_position;
layout(binding = 13) uniform sampler2D real_normal;
layout(binding = 14) uniform sampler2D real_albedo;
layout(binding = 15) uniform sampler2D object_surface;
layout(binding = 25) uniform sampler2D mirror_lost;
layout(binding = 17) uniform sampler2D mirror_all;
layout(binding = 26) uniform sampler2D radiance;
layout(binding = 18, rgba16f) uniform writeonly image2D out_gained;  // radiance; a: 1 where traced
layout(binding = 19, rgba16f) uniform writeonly image2D out_fraction;  // occluded fraction of the image; a: 1 where traced

// Rows of pixels per sample, where the lobe blurs the objects' reflection over many pixels: the filter that follows
// covers two rows. (Half rows would save nothing: software devices run eight pixels of a row together.) Where the blur
// is wide in whole blocks, only one of pass_i.x pixels along each axis is traced.
int rows_alike(float blur_px) { return blur_px > 6.0 ? 2 : 1; }

void main() {
  ivec2 at = frame.pass_i.x * tile_texel();
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  vec4 out_g = vec4(0), out_s = vec4(0);
  vec4 normal = texelFetch(real_normal, at, 0);
  int known = int(texelFetch(real_albedo, at, 0).a);
  vec4 real = texelFetch(real_position, at, 0);
  if (known > 0 && normal.a > 0.0 && shows_room(texelFetch(object_surface, at, 0), real.a)) {
    Surface s = frame.surfaces[known - 1];
    BsdfParams bsdf = bsdf_of(s);
    vec3 p = real.xyz, n = normalize(normal.xyz);
    bool traced = at.y % rows_alike(mirror_blur_px(bsdf.alpha, p)) == 0;
    vec3 v = normalize(frame.T_tag_camera[3].xyz - p);
    int count = traced ? frame.counts2.x : 0;
    float turn = pixel_turn(at / frame.pass_i.x);
    vec3 gained = vec3(0), lost = texelFetch(mirror_lost, at, 0).rgb, all = texelFetch(mirror_all, at, 0).rgb;
    Cone k = cone_from_real(p, n);
    k.tan_half = clamp(0.7 * bsdf.alpha / sqrt(float(count)), 0.01, 0.5);
    for (int i = 0; i < count; ++i) {
      vec3 weight;
      k.w = ggx_sample(bsdf, n, v, vec2(fract(float(i) * 0.61803399 + turn), (float(i) + 0.5) / float(count)), weight);
      if (dot(weight, weight) == 0.0) continue;
      weight /= float(count);
      vec3 g, l, mu;
      mirror_cone(k, g, l, mu);
      gained += weight * g;
      lost += weight * l;
      all += weight * mu;
    }
    out_g = vec4(gained, traced ? 1.0 : 0.0);
    vec3 occluded = clamp(lost / max(all, vec3(1e-6)), vec3(0), vec3(1));
    // A metal has only the specular part; of another material's image, the modelled specular part is used.
    vec3 mirror_part = clamp(all / max(texelFetch(radiance, at, 0).rgb, vec3(1e-6)), vec3(0), vec3(1));
    out_s = vec4(occluded * mix(mirror_part, vec3(1), s.metallic_specular.x), out_g.a);
  }
  for (int i = 0; i < frame.pass_i.x * frame.pass_i.x; ++i) {
    ivec2 q = at + ivec2(i % frame.pass_i.x, i / frame.pass_i.x);
    imageStore(out_gained, q, to_half(i == 0 ? out_g : vec4(0)));
    imageStore(out_fraction, q, to_half(i == 0 ? out_s : vec4(0)));
  }
}
