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
layout(binding = 20, rgba16f) uniform readonly image2D object_emission;
layout(binding = 16, rgba16f) uniform writeonly image2D out_radiance;

struct Arriving {
  vec3 irradiance, mirrored;
};

Arriving arriving(ivec2 cell) {
  return Arriving(texelFetch(irradiance, cell, 0).rgb, texelFetch(mirrored_light, cell, 0).rgb);
}

// Joint bilateral upsampling (Kopf et al. 2007) from the surrounding 3 × 3 cells.
struct Upsampling {
  float weights[9];
  float scale;  // 1 / their sum; 0 without any object
};
ivec2 cell_around(ivec2 at, int i) { return at / frame.pass_i.x + ivec2(i % 3, i / 3) - 1; }

Upsampling upsampling(ivec2 at, ObjectPixel o, float z) {
  int scale = frame.pass_i.x;
  Upsampling from_cells;
  float sum = 0.0;
  ivec2 size = textureSize(irradiance, 0);
  for (int i = 0; i < 9; ++i) {
    from_cells.weights[i] = 0.0;
    ivec2 q = cell_around(at, i);
    if (any(lessThan(q, ivec2(0))) || any(greaterThanEqual(q, size))) continue;
    int block = int(texelFetch(irradiance, q, 0).a) - 1;
    if (block < 0) continue;
    ivec2 from = min(scale * q + ivec2(block % scale, block / scale), frame.picture.xy - 1);
    float off = (texelFetch(object_surface, from, 0).x - z) * frame.pinhole.x / (4.0 * z * float(scale));
    vec2 apart = vec2(from - at) / float(scale);
    float turn = max(dot(o.n, normalize(texelFetch(object_normal, from, 0).xyz)), 0.0);
    from_cells.weights[i] = exp(-off * off - dot(apart, apart)) * pow(turn, 16.0) + 1e-8;
    sum += from_cells.weights[i];
  }
  from_cells.scale = sum > 0.0 ? 1.0 / sum : 0.0;
  return from_cells;
}

Arriving upsample(ivec2 at, Upsampling from_cells) {
  Arriving sum = Arriving(vec3(0), vec3(0));
  for (int i = 0; i < 9; ++i) {
    if (from_cells.weights[i] == 0.0) continue;
    Arriving a = arriving(cell_around(at, i));
    sum.irradiance += from_cells.weights[i] * a.irradiance;
    sum.mirrored += from_cells.weights[i] * a.mirrored;
  }
  return Arriving(from_cells.scale * sum.irradiance, from_cells.scale * sum.mirrored);
}

// Visible share of the four lamps of a group.
vec4 open_of(int group, ivec2 at, Upsampling from_cells) {
  ivec2 image = ivec2(0, group * textureSize(irradiance, 0).y);
  if (frame.pass_i.x == 1) return texelFetch(open_lamps, at + image, 0);
  vec4 sum = vec4(0);
  for (int i = 0; i < 9; ++i) {
    if (from_cells.weights[i] == 0.0) continue;
    sum += from_cells.weights[i] * texelFetch(open_lamps, cell_around(at, i) + image, 0);
  }
  return from_cells.scale * sum;
}

// Reflected radiance over irradiance. `share`, `coat`: of the clearcoat.
vec3 reflects(ObjectPixel o, float share, BsdfParams coat, vec3 w, float tan_half) {
  vec3 under = o.mirror ? under_layer(o.bsdf, o.n, o.v, w) : vec3(1);
  vec3 f = o.bsdf.diffuse * under / kPi + (o.mirror ? ggx_wide(o.bsdf, o.n, o.v, w, tan_half) : vec3(0));
  return share > 0.0 ? mix(f, ggx_wide(coat, o.n, o.v, w, tan_half), share) : f;
}

void main() {
  ivec2 at = tile_texel();
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  vec4 surface = texelFetch(object_surface, at, 0);
  vec3 radiance = vec3(0);
  if (surface.y > 0.0) {
    ObjectPixel o = object_pixel(at);
    vec4 emitted = imageLoad(object_emission, at);
    if (o.glass > 0) transmit(o, emitted.a);
    vec2 coat = o.glass > 0 ? vec2(0) : unpack_coat(emitted.a);
    float share = coat_share(coat.x, dot(o.n, o.v));
    BsdfParams lobe = coat_lobe(coat.y);
    Arriving a;
    Upsampling from_cells;
    if (frame.pass_i.x == 1) {
      a = arriving(at);
    } else {
      from_cells = upsampling(at, o, surface.x);
      a = upsample(at, from_cells);
      if (o.mirror && o.bsdf.alpha < kBroadLobe) a.mirrored = mirrored(o, pixel_turn(at));
    }
    vec4 open_group = vec4(0);
    for (int l = 0, map = 0; l < frame.counts.x; ++l) {
      if ((l & 3) == 0) open_group = open_of(l >> 2, at, from_cells);
      vec3 reflected = vec3(0);
      for (int i = 0; i < frame.counts.w; ++i) {
        LampSample s = lamp_sample(frame.lamps[l], o.p, i, frame.counts.w);
        float cosine = dot(o.n, s.w);
        if (cosine <= 0.0) continue;
        reflected += s.irradiance * reflects(o, share, lobe, s.w, s.tan_half) * cosine;
      }
      float open = open_group[l & 3] * shadow_open(l, o.p);
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
        vec3 f = reflects(o, share, lobe, s.w, s.tan_half);
        MirrorWays ways = mirror_ways(image.x, s, k);
        float passed = 1.0 - mirror_hidden(s, ways);
        radiance += s.irradiance * f * (cosine * passed * mirror_open(ways, passed > 0.005));
      }
    }
    vec3 under = o.mirror ? under_layer_evenly(o.bsdf, dot(o.n, o.v)) : vec3(1);
    radiance += (1.0 - share) * (o.bsdf.diffuse * under / kPi * a.irradiance + a.mirrored + emitted.rgb);
    if (share > 0.0) {
      ObjectPixel coated = o;
      coated.bsdf = lobe;
      radiance += share * mirrored(coated, pixel_turn(at));
    }
    if (o.transmission > 0.0) radiance += passed(o);
  }
  imageStore(out_radiance, at, to_half(vec4(radiance, 1.0)));
}
