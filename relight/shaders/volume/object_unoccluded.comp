#version 460
#extension GL_GOOGLE_include_directive : require
// Irradiance at the vertices of a virtual object by the environment that nothing occludes, in the layout of
// object_gather.comp. pass_m: T_tag_model; pass_i: number of vertices.
#include "common/frame.glsl"
#include "common/unoccluded_irradiance.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 16) readonly buffer Vertices { float vertices[]; };  // kVertexFloats each
layout(std430, binding = 17) writeonly buffer Gathered { vec4 gathered[]; };  // front sides, then back sides

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= uint(frame.pass_i.x)) return;
  uint at = uint(kVertexFloats) * i;
  vec3 p = (frame.pass_m * vec4(vertices[at], vertices[at + 1u], vertices[at + 2u], 1.0)).xyz;
  vec3 n = mat3(frame.pass_m) * vec3(vertices[at + 3u], vertices[at + 4u], vertices[at + 5u]);
  n /= max(length(n), 1e-9);
  gathered[2u * i] = vec4(open_irradiance(p, n), 0.0);
  gathered[2u * i + 1u] = vec4(open_irradiance(p, -n), 0.0);
}
