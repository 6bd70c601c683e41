#version 460
#extension GL_GOOGLE_include_directive : require
// Irradiance at the vertices of a virtual object without the lamps' direct light (thesis eq. 5.23-5.24): by cones over
// the hemisphere, and of lamps' images in mirrors. Depends on the room, the lamps and the objects, not on the camera.
// pass_m: T_tag_model; pass_i: number of vertices, cones over the hemisphere, 1: two-sided surfaces, first vertex.
#include "volume/gather.glsl"
#include "volume/mirror_lamp.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 16) readonly buffer Vertices { float vertices[]; };    // kVertexFloats each
layout(std430, binding = 17) writeonly buffer Gathered { vec4 gathered[]; };    // front sides, then back sides

vec3 arriving(vec3 p, vec3 n) {
  Cone k;
  k.from_real = p + 0.25 * frame.field.x * n;
  k.from_virtual = p + frame.virtual_grid.w * n;
  return gather_rho(k.from_real, k.from_virtual, n, frame.pass_i.y, 0.0) +
         mirrored_irradiance(p, n, k, frame.counts.w, 0.0);
}

void main() {
  uint i = uint(frame.pass_i.w) + gl_GlobalInvocationID.x;
  if (i >= uint(frame.pass_i.x)) return;
  uint at = uint(kVertexFloats) * i;
  vec3 p = (frame.pass_m * vec4(vertices[at], vertices[at + 1u], vertices[at + 2u], 1.0)).xyz;
  vec3 n = mat3(frame.pass_m) * vec3(vertices[at + 3u], vertices[at + 4u], vertices[at + 5u]);
  n /= max(length(n), 1e-9);
  vec3 front = arriving(p, n), back = front;
  for (int side = 0; side < frame.pass_i.z; ++side) back = arriving(p, -n);
  gathered[2u * i] = vec4(front, 0.0);
  gathered[2u * i + 1u] = vec4(back, 0.0);
}
