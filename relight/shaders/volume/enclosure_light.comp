#version 460
#extension GL_GOOGLE_include_directive : require
// Reflection of the enclosure: the fish-eye camera saw radiance L there and its irradiance is E, so a change of E
// changes L by L / E times that, whatever the albedo. Where the implied albedo πL / E exceeds the physical range, the
// surface is an emitter and reflects nothing. Also the lamps' irradiance that it loses. pass_i.x: cones over the
// hemisphere.
#include "volume/enclosure.glsl"
#include "common/lamp.glsl"
#include "common/half.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 18, rgba16f) uniform writeonly image2D out_response;  // radiance over irradiance
layout(binding = 19, rgba16f) uniform writeonly image2D out_lost;      // irradiance

const float kMaxAlbedo = 0.9, kShines = 1.1;

void main() {
  ivec2 at = ivec2(gl_GlobalInvocationID.xy), size = imageSize(out_response);
  if (any(greaterThanEqual(at, size))) return;
  vec3 p, n, response = vec3(0), lost = vec3(0);
  if (enclosure_point(at, size, p, n)) {
    Cone k;
    k.from_virtual = p;
    k.from_real = p + frame.cascade[0].w * n;
    vec3 e = gather_mu(k.from_real, p, n, frame.pass_i.x, pixel_turn(at));
    for (int l = 0; l < frame.counts.x; ++l) {
      for (int i = 0; i < frame.counts.w; ++i) {
        LampSample s = lamp_sample(frame.lamps[l], p, i, frame.counts.w);
        float cosine = dot(n, s.w);
        if (cosine <= 0.0) continue;
        k.w = s.w;
        k.tan_half = s.tan_half;
        vec3 falls = s.irradiance * (cosine * (1.0 - real_shadow(k, s.distance)));
        e += falls;
        lost += falls * virtual_shadow(k, s.distance);
      }
    }
    vec3 radiance = environment_radiance(normalize(p - frame.probe.xyz), 1.0 / float(size.x));
    vec3 albedo = kPi * radiance / max(e, vec3(1e-6));
    response = albedo / kPi * (1.0 - smoothstep(kMaxAlbedo, kShines, max(max(albedo.r, albedo.g), albedo.b)));
  }
  imageStore(out_response, at, to_half(vec4(response, 1.0)));
  imageStore(out_lost, at, to_half(vec4(frame.blocked.rgb * lost, 1.0)));
}
