#version 460
#extension GL_GOOGLE_include_directive : require
// Lists the voxels of both cascades in front of virtual surfaces, and marks their chunks.
#include "volume/volume.glsl"
#include "volume/voxel_mark.glsl"
layout(local_size_x = 8, local_size_y = 4, local_size_z = 2) in;

void main() {
  ivec3 at = ivec3(gl_GlobalInvocationID);
  int n = frame.grid.x;
  if (any(greaterThanEqual(at, ivec3(n, n, kCascades * n)))) return;
  vec4 cascade = frame.cascade[at.z / n];
  if (front_weight(virtual_distance(cascade.xyz + cascade.w * vec3(at.xy, at.z % n)), cascade.w) > 0.0) take_voxel(at);
}
