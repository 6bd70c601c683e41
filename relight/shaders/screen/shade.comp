#version 460
#extension GL_GOOGLE_include_directive : require
// Radiance of the virtual objects (thesis eq. 5.23-5.25): lamps with GGX over Lambert, and the results of ambient.comp,
// upsampled between pixels of similar depth and normal. pass_i.x: scale of these.
#include "screen/object_pixel.glsl"
#include "volume/mirror_lamp.glsl"
#include "common/half.glsl"
#include "common/tiles.glsl"
layout(binding = 17) uniform sampler2D irradiance;
layout(binding = 18) uniform sampler2D mirrored_light;
layout(binding = 19) uniform sampler2D open_lamps;
layout(binding = 16, rgba16f) uniform writeonly image2D out_radiance;

struct Arriving {
  vec3 irradiance, mirrored;
  vec4 open, open_more;
};

Arriving arriving(ivec2 cell) {
  return Arriving(texelFetch(irradiance, cell, 0).rgb, texelFetch(mirrored_light, cell, 0).rgb,
                  texelFetch(open_lamps, cell, 0),
                  texelFetch(open_lamps, cell + ivec2(0, textureSize(irradiance, 0).y), 0));
}

// Joint bilateral upsampling (Kopf et al. 2007) from the surrounding 3 × 3 cells.
Arriving upsample(ivec2 at, ObjectPixel o, float z) {
  int scale = frame.pass_i.x;
  Arriving sum = Arriving(vec3(0), vec3(0), vec4(0), vec4(0));
  float weights = 0.0;
  ivec2 size = textureSize(irradiance, 0);
  for (int i = 0; i < 9; ++i) {
    ivec2 q = at / scale + ivec2(i % 3, i / 3) - 1;
    if (any(lessThan(q, ivec2(0))) || any(greaterThanEqual(q, size))) continue;
    int block = int(texelFetch(irradiance, q, 0).a) - 1;
    if (block < 0) continue;
    ivec2 from = min(scale * q + ivec2(block % scale, block / scale), frame.picture.xy - 1);
    float off = (texelFetch(object_surface, from, 0).x - z) * frame.pinhole.x / (4.0 * z * float(scale));
    vec2 apart = vec2(from - at) / float(scale);
    float turn = max(dot(o.n, normalize(texelFetch(object_normal, from, 0).xyz)), 0.0);
    float w = exp(-off * off - dot(apart, apart)) * pow(turn, 16.0) + 1e-8;
    Arriving a = arriving(q);
    sum.irradiance += w * a.irradiance;
    sum.mirrored += w * a.mirrored;
    sum.open += w * a.open;
    sum.open_more += w * a.open_more;
    weights += w;
  }
  float k = weights > 0.0 ? 1.0 / weights : 0.0;
  return Arriving(k * sum.irradiance, k * sum.mirrored, k * sum.open, k * sum.open_more);
}

void main() {
  ivec2 at = tile_texel();
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  vec4 surface = texelFetch(object_surface, at, 0);
  vec3 radiance = vec3(0);
  if (surface.y > 0.0) {
    ObjectPixel o = object_pixel(at);
    Arriving a;
    if (frame.pass_i.x == 1) {
      a = arriving(at);
    } else {
      a = upsample(at, o, surface.x);
      if (o.mirror && o.bsdf.alpha < kBroadLobe) a.mirrored = mirrored(o, pixel_turn(at));
    }
    vec3 out_again = through(o.bsdf, dot(o.n, o.v));
    for (int l = 0, map = 0; l < frame.counts.x; ++l) {
      vec3 reflected = vec3(0);
      for (int i = 0; i < frame.counts.w; ++i) {
        LampSample s = lamp_sample(frame.lamps[l], o.p, i, frame.counts.w);
        float cosine = dot(o.n, s.w);
        if (cosine <= 0.0) continue;
        vec3 under = o.mirror ? through(o.bsdf, cosine) * out_again : vec3(1);
        vec3 f = o.bsdf.diffuse * under / kPi + (o.mirror ? ggx_wide(o.bsdf, o.n, o.v, s.w, s.tan_half) : vec3(0));
        reflected += s.irradiance * f * cosine;
      }
      float open = l < 4 ? a.open[l] : a.open_more[l - 4];
      int maps = int(frame.lamps[l].intensity.a);
      if (maps > 0) open *= map_open(map, maps, o.p, o.n);
      radiance += reflected * open;
      map += maps;
    }
    Cone k;
    k.from_real = o.from_real;
    k.from_virtual = o.from_virtual;
    for (int j = 0; j < frame.mirror_counts.y; ++j) {
      ivec3 image = image_of(j);
      for (int i = 0; i < frame.counts.w; ++i) {
        MirrorSample s = mirror_sample(image.x, image.y, image.z, o.p, i, frame.counts.w, 0.0);
        float cosine = dot(o.n, s.w);
        if (cosine <= 0.0 || s.irradiance == vec3(0)) continue;
        vec3 under = o.mirror ? through(o.bsdf, cosine) * out_again : vec3(1);
        vec3 f = o.bsdf.diffuse * under / kPi + (o.mirror ? ggx_wide(o.bsdf, o.n, o.v, s.w, s.tan_half) : vec3(0));
        MirrorWays ways = mirror_ways(image.x, s, k);
        float passed = 1.0 - mirror_hidden(s, ways);
        radiance += s.irradiance * f * (cosine * passed * mirror_open(ways, passed > 0.005));
      }
    }
    vec3 under = o.mirror ? through_evenly(o.bsdf) * out_again : vec3(1);
    radiance += o.bsdf.diffuse * under / kPi * a.irradiance + a.mirrored;
  }
  imageStore(out_radiance, at, to_half(vec4(radiance, 1.0)));
}
