#version 460
#extension GL_GOOGLE_include_directive : require
// Shadows of the objects on real surfaces (thesis eq. 5.20), rendered from the lamps: every ray of a lamp ends on the
// first surface along it (shadow_receiver_map.comp), so one image per lamp holds all of its lost light. The lamps'
// images are stacked vertically.
#include "volume/cone.glsl"
#include "lamps/lamp_maps.glsl"
#include "common/half.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 9) uniform sampler2D ground_place;
layout(binding = 10) uniform sampler2D ground_normal;
layout(std430, binding = 17) readonly buffer Blocks { uvec2 blocks[]; };  // written by lamp_tiles.comp
layout(std430, binding = 18) buffer Shaded { uint shaded[]; };  // by block: 1 if visible light is lost there
layout(binding = 16, rgba16f) uniform writeonly image2D out_map;  // occluded fraction; depth beyond the sphere's centre

void main() {
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  int edge = imageSize(out_map).x, lamp = at.y / edge;
  if (at.x >= edge || lamp >= frame.counts.x) return;
  vec4 place = texelFetch(ground_place, at, 0), ground = texelFetch(ground_normal, at, 0);
  vec3 p = place.xyz, n = ground.xyz;
  Lamp source = frame.lamps[lamp];
  int maps = int(source.intensity.a), first = first_map_of(lamp);
  float lost = 0.0, all = 0.0;
  uvec2 hiding = blocks[(at.y / 8) * (edge / 8) + at.x / 8];
  // As in shadow.comp.
  for (int i = 0; i < ((hiding.x | hiding.y) != 0u ? maps : 0); ++i) {
    LampSample s = map_sample(source, lamp_views[first + i], p, maps);
    float weight = emission(source, -s.w) * max(dot(n, s.w), 0.0) / (s.distance * s.distance);
    all += weight;
    lost += weight * float((hiding.y >> uint(i)) & 1u);
  }
  for (uint left = hiding.x; left != 0u; left &= left - 1u) {
    LampMap m = lamp_views[first + findLSB(left)];
    LampSample s = map_sample(source, m, p, maps);
    float weight = emission(source, -s.w) * max(dot(n, s.w), 0.0) / (s.distance * s.distance);
    lost += weight * disc_hidden(m, p, kBefore_m);
  }
  lost *= ground.a;
  Cone k = cone_from_real(p, n);
  for (int i = 0; i < (maps > 0 ? 0 : frame.counts.w); ++i) {
    LampSample s = lamp_sample(source, p, i, frame.counts.w);
    float cosine = dot(n, s.w) * emission(source, -s.w);
    if (cosine <= 0.0) continue;
    all += cosine;
    k.w = s.w;
    k.tan_half = s.tan_half;
    float hidden = virtual_shadow(k, s.distance);
    if (hidden > 0.0) lost += cosine * hidden * (1.0 - real_shadow(k, s.distance));
  }
  float fraction = all > 0.0 ? lost / all : 0.0;
  if (fraction >= frame.pass_f.x) atomicOr(shaded[(at.y / 8) * (edge / 8) + at.x / 8], 1u);
  imageStore(out_map, at, to_half(vec4(fraction, place.w, 0.0, 0.0)));
}
