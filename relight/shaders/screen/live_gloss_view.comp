#version 460
#extension GL_GOOGLE_include_directive : require
// Glossy surfaces of known material in the live view: their position, the change of their diffuse part, and the light
// of lamps by their specular part, with and without the objects. Evaluated per sample of a lamp, since the part that
// objects occlude may be the part that the surface reflects most. The lamps' shadow images select where to test.
#include "screen/live_real.glsl"
#include "volume/lamp_visibility.glsl"
#include "screen/lamp_shadow.glsl"
#include "common/material_mask.glsl"
#include "common/half.glsl"
#include "common/tiles.glsl"
layout(binding = 23) uniform sampler2D radiance;
layout(binding = 28) uniform sampler2D surfaces;  // depth along z and number + 1 of surfaces of known material
layout(binding = 12, rgba32f) uniform writeonly image2D out_position;     // a: z in the camera frame, 0: unknown
layout(binding = 13, rgba16f) uniform writeonly image2D out_normal;       // a: influence mask, 0 to 1
layout(binding = 14, rgba16f) uniform writeonly image2D out_albedo;  // a: known material's number + 1
layout(binding = 15, rgba16f) uniform writeonly image2D out_diffuse;      // change of radiance
layout(binding = 17, rgba16f) uniform writeonly image2D out_mirror_lost;  // radiance
layout(binding = 18, rgba16f) uniform writeonly image2D out_mirror_all;

void main() {
  ivec2 at = tile_texel();
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  LiveReal r = live_real(at, texelFetch(codes, at, 0).rgb);
  float z = (frame.T_camera_tag * vec4(r.p, 1.0)).z;
  vec2 surface = texelFetch(surfaces, at, 0).xy;
  vec3 w = mat3(frame.T_tag_camera) * vec3(texelFetch(rays, at, 0).xy, 1.0);
  float known = dot(r.n, r.n) > 0.0 ? known_material(at, surface, r.p, z, w) : 0.0;
  vec3 diffuse = vec3(0), mirror_lost = vec3(0), mirror_all = vec3(0);
  if (known > 0.0) {
    BsdfParams bsdf = bsdf_of(frame.surfaces[int(known) - 1]);
    float paper = paper_coverage(known);
    vec3 under = mix(through_evenly(bsdf) * through_evenly(bsdf), vec3(1), paper);
    vec3 brdf = mix(bsdf.diffuse / kPi, r.response * texelFetch(radiance, at, 0).rgb, paper);
    diffuse = brdf * under * (r.indirect - lamps_lost(r));
    Cone k = cone_from_real(r.p, r.n);
    vec3 v = normalize(frame.T_tag_camera[3].xyz - r.p);
    for (int l = 0, map = 0; l < frame.counts.x; ++l) {
      Lamp lamp = frame.lamps[l];
      int maps = int(lamp.intensity.a), count = maps > 0 ? maps : frame.counts.w;
      float mostly = lamp_hidden(l, r.p, r.slack);
      vec3 sent = vec3(0), gone = vec3(0);
      for (int i = 0; i < count; ++i) {
        LampSample q = maps > 0 ? map_sample(lamp, lamp_views[map + i], r.p, count) : lamp_sample(lamp, r.p, i, count);
        vec3 f = q.irradiance * max(dot(r.n, q.w), 0.0) * ggx_wide(bsdf, r.n, v, q.w, q.tan_half);
        float hidden = mostly;
        for (int j = 0; j < (maps > 0 && mostly > 0.0 ? 1 : 0); ++j) {
          hidden = disc_hidden(lamp_views[map + i], r.p, kBefore_m) * (1.0 - moved_hidden(lamp_views[map + i], r.p, moved_before(r)));
        }
        sent += f;
        gone += hidden * f;
      }
      float open = lamp_open(k, lamp, sent != vec3(0)) * shadow_open(l, r.p);
      mirror_all += open * sent;
      mirror_lost += open * gone;
      map += maps;
    }
  }
  imageStore(out_position, at, vec4(r.p, z));
  imageStore(out_normal, at, to_half(vec4(r.n, known > 0.0 ? 1.0 : 0.0)));
  imageStore(out_albedo, at, to_half(vec4(0.0, 0.0, 0.0, known)));
  imageStore(out_diffuse, at, to_half(vec4(diffuse, 0.0)));
  imageStore(out_mirror_lost, at, to_half(vec4(frame.blocked.rgb * mirror_lost, 0.0)));
  imageStore(out_mirror_all, at, to_half(vec4(mirror_all, 0.0)));
}
