#version 460
#extension GL_GOOGLE_include_directive : require
// Radiance of the virtual objects (thesis eq. 5.23-5.25): lamps with GGX over Lambert and shadow cones through real and
// virtual surfaces, cones over the hemisphere for everything else, and cones along the lobe for the mirror part.
#include "gather.glsl"
#include "lamp.glsl"
#include "brdf.glsl"
#include "half.glsl"
#include "tiles.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 12) uniform sampler2D object_normal;
layout(binding = 13) uniform sampler2D object_base;
layout(binding = 14) uniform sampler2D object_surface;
layout(binding = 15) uniform sampler2D rays;
layout(binding = 16, rgba16f) uniform writeonly image2D out_radiance;

void main() {
  ivec2 at = tile_texel();
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  vec4 surface = texelFetch(object_surface, at, 0);
  vec3 radiance = vec3(0);
  if (surface.y > 0.0) {
    vec4 normal = texelFetch(object_normal, at, 0), base = texelFetch(object_base, at, 0);
    vec3 eye = frame.T_tag_camera[3].xyz;
    vec3 p = eye + mat3(frame.T_tag_camera) * (surface.x * vec3(texelFetch(rays, at, 0).xy, 1.0));
    vec3 v = normalize(eye - p), n = normalize(normal.xyz);
    Look look = look_of(base.rgb, normal.a, base.a, surface.z);
    bool mirror = look.f90 + base.a > 0.0;
    float turn = pixel_turn(at);
    Cone k;
    k.from_real = p + 0.25 * frame.field.x * n;
    k.from_virtual = p + 1.0 * frame.virtual_grid.w * n;

    for (int l = 0; l < frame.counts.x; ++l) {
      for (int i = 0; i < frame.counts.w; ++i) {
        LampSample s = lamp_share(frame.lamps[l], p, i, frame.counts.w);
        float cosine = dot(n, s.w);
        if (cosine <= 0.0) continue;
        k.w = s.w;
        k.tan_half = s.tan_half;
        vec2 open = shadow_cone(k, s.distance);
        vec3 under = vec3(1) - (mirror ? fresnel(look, dot(v, normalize(v + s.w))) : vec3(0));
        vec3 f = look.diffuse * under / kPi + (mirror ? ggx_wide(look, n, v, s.w, s.tan_half) : vec3(0));
        radiance += s.irradiance * f * (cosine * open.x * open.y);
      }
    }

    vec3 under = vec3(1) - (mirror ? fresnel(look, dot(n, v)) : vec3(0));
    if (base.a < 1.0)
      radiance += look.diffuse * under / kPi * gather_rho(k.from_real, k.from_virtual, n, frame.counts.z, turn);
    if (mirror) {
      int count = frame.counts2.x;
      k.tan_half = clamp(0.7 * look.alpha / sqrt(float(count)), 0.01, 0.5);
      vec3 sum = vec3(0);
      for (int i = 0; i < count; ++i) {
        vec3 weight;
        k.w = ggx_sample(look, n, v, vec2(fract(float(i) * 0.61803399 + turn), (float(i) + 0.5) / float(count)), weight);
        if (dot(weight, weight) > 0.0) sum += weight * rho_cone(k);
      }
      radiance += sum / float(count);
    }
  }
  imageStore(out_radiance, at, to_half(vec4(radiance, 1.0)));
}
