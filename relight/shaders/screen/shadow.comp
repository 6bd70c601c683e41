#version 460
#extension GL_GOOGLE_include_directive : require
// Direct change T_delta_1 (thesis eq. 5.20): light of lamps that a real surface loses. Every lamp is sampled by a few
// narrow shadow cones; light that a real surface blocks already is not subtracted again. Where a cell represents a
// block of pixels, cells use every second sample of a lamp in a checkerboard pattern: the upsampling filter weighs both
// halves equally.
#include "screen/shadow_cell.glsl"
#include "lamps/lamp_maps.glsl"
#include "common/half.glsl"
#include "common/tiles.glsl"
layout(binding = 16, rgba16f) uniform writeonly image2D out_lost;  // irradiance; pixel in the block, plus 1; 0: none

vec3 lost_by_cones(Cone k, Lamp lamp, vec3 n, ivec2 cell) {
  vec3 lost = vec3(0);
  int stride = frame.pass_i.x > 1 && frame.counts.w > 1 ? 2 : 1;
  for (int i = (cell.x + cell.y) % stride; i < frame.counts.w; i += stride) {
    LampSample s = lamp_sample(lamp, k.from_virtual, i, frame.counts.w);
    float cosine = dot(n, s.w);
    k.w = s.w;
    k.tan_half = s.tan_half;
    float hidden = virtual_shadow(k, cosine > 0.0 ? s.distance : 0.0);
    if (hidden == 0.0) continue;
    lost += s.irradiance * (cosine * hidden * (1.0 - real_shadow(k, s.distance)) * float(stride));
  }
  return lost;
}

// Each map's part of the lamp is occluded by objects or not; the fraction of the lamp that real surfaces occlude is
// applied to each part.
vec3 lost_by_maps(Cone k, Lamp lamp, int first, int count, vec3 n) {
  vec3 lost = vec3(0), p = k.from_virtual;
  for (int i = first; i < first + count; ++i) {
    LampSample s = map_sample(lamp, lamp_views[i], p, count);
    float hidden = disc_hidden(lamp_views[i], p, kBefore_m);
    if (hidden > 0.0) lost += s.irradiance * (max(dot(n, s.w), 0.0) * hidden * (1.0 - moved_hidden(lamp_views[i], p, kBefore_m)));
  }
  if (lost == vec3(0)) return lost;
  return lost * lamp_open(k, lamp, true);
}

void main() {
  ivec2 cell = tile_texel(), at;
  if (any(greaterThanEqual(cell, imageSize(out_lost)))) return;
  vec3 n, lost = vec3(0);
  int block = shadow_pixel(cell, at, n);
  if (block >= 0) {
    Cone k = cone_from_real(texelFetch(real_position, at, 0).xyz, n);
    for (int l = 0, map = 0; l < frame.counts.x; ++l) {
      int maps = int(frame.lamps[l].intensity.a);
      vec3 of_lamp = maps > 0 ? lost_by_maps(k, frame.lamps[l], map, maps, n) : lost_by_cones(k, frame.lamps[l], n, cell);
      lost += shadow_open(l, k.from_virtual) * of_lamp;
      map += maps;
    }
  }
  imageStore(out_lost, cell, to_half(vec4(frame.blocked.rgb * lost, float(block + 1))));
}
