#version 460
#extension GL_GOOGLE_include_directive : require
// Lists the voxels of both cascades in front of virtual surfaces, and within two voxels of real ones.
#include "volume.glsl"
#include "voxel_list.glsl"
layout(local_size_x = 8, local_size_y = 4, local_size_z = 2) in;
layout(binding = 12, r16f) uniform readonly image3D distance_real;

void main() {
  ivec3 at = ivec3(gl_GlobalInvocationID);
  int n = frame.grid.x;
  if (any(greaterThanEqual(at, ivec3(n, n, kCascades * n)))) return;
  int c = at.z / n;
  float edge = frame.cascade[c].w;
  vec3 p = frame.cascade[c].xyz + edge * vec3(at.xy, at.z - c * n);
  bool is_virtual = front_weight(virtual_distance(p), edge) > 0.0;
  bool is_real = abs(imageLoad(distance_real, at).r) < min(2.0 * edge, 0.9 * frame.field.y);
  if (is_virtual || is_real) list_voxel(at, is_virtual, is_real);
}
