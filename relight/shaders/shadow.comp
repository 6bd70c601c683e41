#version 460
#extension GL_GOOGLE_include_directive : require
// Direct change T_delta_1 (thesis eq. 5.20): what lamps no longer bring to a real surface. Every lamp is a handful of
// narrow shadow cones; light that a real surface blocks already is not taken twice. Where cells stand for blocks of pixels
// they take every second share of a lamp in turn, like the fields of a chessboard: the filter that upsamples them weighs
// both alike.
#include "cone.glsl"
#include "lamp.glsl"
#include "brdf.glsl"
#include "half.glsl"
#include "tiles.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 12) uniform sampler2D real_position;
layout(binding = 13) uniform sampler2D real_normal;
layout(binding = 14) uniform sampler2D real_albedo;
layout(binding = 15) uniform sampler2D object_surface;
layout(binding = 16, rgba16f) uniform writeonly image2D out_lost;  // irradiance; which pixel of the block it stands for, plus 1; 0: none
layout(binding = 17, rgba16f) uniform writeonly image2D out_mirror_lost;  // radiance off known glossy surfaces
layout(binding = 18, rgba16f) uniform writeonly image2D out_mirror_all;   // what lamps send there without objects

void main() {
  int scale = frame.pass_i.x, block = -1;
  ivec2 cell = tile_texel(), at = cell;
  if (any(greaterThanEqual(cell, imageSize(out_lost)))) return;
  vec3 lost = vec3(0), mirror_lost = vec3(0), mirror_all = vec3(0);
  vec4 normal = vec4(0);
  for (int i = 0; i < scale * scale && block < 0; ++i) {  // the first pixel of the block that the objects can change
    at = min(scale * cell + ivec2(i % scale, i / scale), frame.picture.xy - 1);
    normal = texelFetch(real_normal, at, 0);
    if (normal.a > 0.0 && texelFetch(object_surface, at, 0).y < 0.999) block = i;
  }
  if (block >= 0) {
    vec3 p = texelFetch(real_position, at, 0).xyz, n = normalize(normal.xyz);
    vec3 v = normalize(frame.T_tag_camera[3].xyz - p);
    int known = int(texelFetch(real_albedo, at, 0).a);
    bool glossy = known > 0;
    Look look;
    if (glossy) {
      Surface s = frame.surfaces[known - 1];
      look = look_of(s.base_color_roughness.rgb, s.base_color_roughness.a, s.metallic_specular.x, s.metallic_specular.y);
    }
    Cone k;
    k.from_virtual = p;
    k.from_real = p + max(frame.cascade[0].w, 0.75 * frame.field.x) * n;
    int stride = scale > 1 && frame.counts.w > 1 ? 2 : 1;
    for (int l = 0; l < frame.counts.x; ++l) {
      for (int i = (cell.x + cell.y) % stride; i < frame.counts.w; i += stride) {
        LampSample s = lamp_share(frame.lamps[l], p, i, frame.counts.w);
        float cosine = dot(n, s.w);
        if (cosine <= 0.0) continue;
        k.w = s.w;
        k.tan_half = s.tan_half;
        vec2 reach = virtual_stretch(k);
        bool shaded = reach.x < reach.y && reach.y > 0.0 && reach.x < s.distance;
        if (!shaded && !glossy) continue;
        float m_v = virtual_shadow(k, s.distance);
        float open = 1.0 - real_shadow(k, glossy || m_v > 0.0 ? s.distance : 0.0), gone = open * m_v;
        lost += s.irradiance * (cosine * gone * float(stride));
        if (glossy) {
          vec3 f = s.irradiance * (cosine * float(stride)) * ggx_wide(look, n, v, s.w, s.tan_half);
          mirror_lost += gone * f;
          mirror_all += open * f;
        }
      }
    }
  }
  imageStore(out_lost, cell, to_half(vec4(lost, float(block + 1))));
  imageStore(out_mirror_lost, at, to_half(vec4(mirror_lost, 0.0)));
  imageStore(out_mirror_all, at, to_half(vec4(mirror_all, 0.0)));
}
