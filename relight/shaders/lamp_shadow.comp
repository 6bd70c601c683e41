#version 460
#extension GL_GOOGLE_include_directive : require
// Shadows that the objects throw on real surfaces (thesis eq. 5.20), as the lamps see them: every lamp's light ends on the
// first surface along its way, so one picture a lamp holds all that its light loses. It depends on the room, the lamps and
// the objects alone, not on the camera. The lamps' pictures lie one above the other.
#include "cone.glsl"
#include "lamp_maps.glsl"
#include "half.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 9) uniform sampler3D real_normal_volume;
layout(binding = 16, rgba16f) uniform writeonly image2D out_map;  // share that is hidden; depth beyond the sphere's middle

void main() {
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  int edge = imageSize(out_map).x, lamp = at.y / edge;
  if (at.x >= edge || lamp >= frame.counts.x) return;
  ShadowView view = frame.shadow_views[lamp];
  vec3 from = frame.lamps[lamp].position_radius.xyz;
  vec2 q = (2.0 * (vec2(at.x, at.y - lamp * edge) + 0.5) / float(edge) - 1.0) / view.x_scale.w;
  vec3 w = normalize(q.x * view.x_scale.xyz + q.y * view.y.xyz + view.z_far.xyz);

  vec2 known = ray_box(from, w, grid_low(frame.cascade[1]), cascade_high(1));
  float least = 0.5 * frame.cascade[0].w, t = max(known.x + frame.cascade[1].w, 0.0);
  bool hit = false;
  for (int i = 0; i < 128 && t < known.y && !hit; ++i) {
    float d = real_distance(from + t * w);
    hit = d < 0.1 * least;
    t += hit ? 0.0 : max(d, 0.5 * least);
  }
  // Where nothing is known the light ends at the volumes' edge; what lies beyond takes the shadow from there.
  vec3 p = from + (hit ? t : max(known.y, view.z_far.w)) * w, n = -w;
  if (hit) {
    vec3 normal = textureLod(real_normal_volume, cascade_place(in_cascade(0, p, 1.0) ? 0 : 1, p, 0.5), 0.0).xyz;
    if (dot(normal, normal) > 0.25) n = normalize(normal);
  }

  Cone k;
  k.from_virtual = p;
  k.from_real = p + max(frame.cascade[0].w, 0.75 * frame.field.x) * n;
  Lamp source = frame.lamps[lamp];
  int maps = int(source.intensity.a), first = 0;
  for (int l = 0; l < lamp; ++l) first += int(frame.lamps[l].intensity.a);
  float lost = 0.0, all = 0.0;
  // As in shadow.comp.
  for (int i = first; i < first + maps; ++i) {
    LampSample s = map_share(source, lamp_views[i], p, maps);
    float weight = emission(source, -s.w) * max(dot(n, s.w), 0.0) / (s.distance * s.distance);
    all += weight;
    lost += weight * map_hidden(lamp_views[i], p, kBefore_m);
  }
  if (lost > 0.0) {
    vec3 to = source.position_radius.xyz - p;
    k.w = to / length(to);
    k.tan_half = source.position_radius.w / length(to);
    lost *= 1.0 - real_shadow(k, length(to));
  }
  for (int i = 0; i < (maps > 0 ? 0 : frame.counts.w); ++i) {
    LampSample s = lamp_share(source, p, i, frame.counts.w);
    float cosine = dot(n, s.w) * emission(source, -s.w);
    if (cosine <= 0.0) continue;
    all += cosine;
    k.w = s.w;
    k.tan_half = s.tan_half;
    float hidden = virtual_shadow(k, s.distance);
    if (hidden > 0.0) lost += cosine * hidden * (1.0 - real_shadow(k, s.distance));
  }
  float depth = dot(p - from, view.z_far.xyz) - view.z_far.w;
  imageStore(out_map, at, to_half(vec4(all > 0.0 ? lost / all : 0.0, depth, 0.0, 0.0)));
}
