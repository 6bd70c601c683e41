#version 460
#extension GL_GOOGLE_include_directive : require
// Irradiance at the vertices of a virtual object: of lamps by their maps and by shadow cones, plus the results of
// object_gather.comp, blended from one round to the next. pass_m: T_tag_model; pass_i: number of vertices, 0, 1:
// two-sided surfaces; pass_f.x: weight of the newer round.
#include "volume/cone.glsl"
#include "lamps/lamp_maps.glsl"
#include "volume/lamp_visibility.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 16) readonly buffer Vertices { float vertices[]; };  // kVertexFloats each
layout(std430, binding = 17) writeonly buffer Light { vec4 light[]; };        // front sides, then back sides
layout(std430, binding = 18) readonly buffer Older { vec4 older[]; };
layout(std430, binding = 19) readonly buffer Newer { vec4 newer[]; };

vec3 of_lamps(vec3 p, vec3 n) {
  vec3 from_real = p + 0.25 * frame.field.x * n, from_virtual = p + frame.virtual_grid.w * n, e = vec3(0);
  for (int l = 0, map = 0; l < frame.counts.x; ++l) {
    Lamp lamp = frame.lamps[l];
    int maps = int(lamp.intensity.a);
    float open = lamp_visibility(p, n, from_real, from_virtual, lamp, 0, 1).x * shadow_open(l, p);
    if (maps > 0) open *= map_open(map, maps, p, n);
    e += lamp.intensity.rgb * open;
    map += maps;
  }
  return e;
}

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= uint(frame.pass_i.x)) return;
  uint at = uint(kVertexFloats) * i;
  vec3 p = (frame.pass_m * vec4(vertices[at], vertices[at + 1u], vertices[at + 2u], 1.0)).xyz;
  vec3 n = mat3(frame.pass_m) * vec3(vertices[at + 3u], vertices[at + 4u], vertices[at + 5u]);
  n /= max(length(n), 1e-9);
  vec3 front = of_lamps(p, n), back = front;
  for (int side = 0; side < frame.pass_i.z; ++side) back = of_lamps(p, -n);
  light[2u * i] = vec4(front + mix(older[2u * i].rgb, newer[2u * i].rgb, frame.pass_f.x), 0.0);
  light[2u * i + 1u] = vec4(back + mix(older[2u * i + 1u].rgb, newer[2u * i + 1u].rgb, frame.pass_f.x), 0.0);
}
