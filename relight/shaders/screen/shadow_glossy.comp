#version 460
#extension GL_GOOGLE_include_directive : require
// As shadow.comp where the material of real surfaces is known: includes the lamps' highlights, and runs at full
// resolution. pass_i.y: samples of a lamp's image in a mirror.
#include "screen/shadow_cell.glsl"
#include "volume/mirror_lamp.glsl"
#include "common/half.glsl"
#include "common/material_mask.glsl"
#include "common/tiles.glsl"
layout(binding = 14) uniform sampler2D real_albedo;
layout(binding = 16, rgba16f) uniform writeonly image2D out_lost;         // irradiance
layout(binding = 17, rgba16f) uniform writeonly image2D out_mirror_lost;  // specular radiance, known material
layout(binding = 18, rgba16f) uniform writeonly image2D out_mirror_all;  // likewise, without objects

void main() {
  ivec2 cell = tile_texel(), at;
  if (any(greaterThanEqual(cell, imageSize(out_lost)))) return;
  vec3 n, lost = vec3(0), mirror_lost = vec3(0), mirror_all = vec3(0);
  if (shadow_pixel(cell, at, n) >= 0) {
    vec3 p = texelFetch(real_position, at, 0).xyz, v = normalize(frame.T_tag_camera[3].xyz - p);
    int known = int(texelFetch(real_albedo, at, 0).a);
    bool glossy = known > 0;
    BsdfParams bsdf;
    if (glossy) bsdf = bsdf_of(frame.surfaces[known - 1]);
    Cone k = cone_from_real(p, n);
    for (int l = 0, map = 0; l < frame.counts.x; ++l) {
      Lamp lamp = frame.lamps[l];
      int maps = int(lamp.intensity.a), count = maps > 0 ? maps : frame.counts.w;
      vec3 gone = vec3(0), mirror_gone = vec3(0), mirror_sent = vec3(0);
      for (int i = 0; i < count; ++i) {
        LampSample s = maps > 0 ? map_sample(lamp, lamp_views[map + i], p, count) : lamp_sample(lamp, p, i, count);
        float cosine = dot(n, s.w);
        if (cosine <= 0.0) continue;
        k.w = s.w;
        k.tan_half = s.tan_half;
        float hidden = maps > 0 ? disc_hidden(lamp_views[map + i], p, kBefore_m) : virtual_shadow(k, s.distance);
        if (hidden == 0.0 && !glossy) continue;
        if (hidden > 0.0 && maps > 0) hidden *= 1.0 - moved_hidden(lamp_views[map + i], p, kBefore_m);
        // Light passes the layer on its way to the body and back.
        vec3 under = glossy ? through(bsdf, cosine) * through(bsdf, dot(n, v)) : vec3(1);
        gone += s.irradiance * under * (cosine * hidden);
        if (glossy) {
          vec3 f = s.irradiance * cosine * ggx_wide(bsdf, n, v, s.w, s.tan_half);
          mirror_gone += hidden * f;
          mirror_sent += f;
        }
      }
      // The fraction of the lamp that real surfaces occlude is applied to each sample.
      float open = lamp_open(k, lamp, gone != vec3(0) || mirror_sent != vec3(0)) * shadow_open(l, p);
      lost += open * gone;
      mirror_lost += open * mirror_gone;
      mirror_all += open * mirror_sent;
      map += maps;
    }
    lost += mirrored_lost(p, n, k, is_metal(texelFetch(real_albedo, at, 0).a) ? 0 : frame.pass_i.y, 0.0);
  }
  imageStore(out_lost, cell, to_half(vec4(frame.blocked.rgb * lost, 0.0)));
  imageStore(out_mirror_lost, at, to_half(vec4(frame.blocked.rgb * mirror_lost, 0.0)));
  imageStore(out_mirror_all, at, to_half(vec4(mirror_all, 0.0)));
}
