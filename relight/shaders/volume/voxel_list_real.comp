#version 460
#extension GL_GOOGLE_include_directive : require
// Lists the voxels of both cascades within two voxels of real surfaces, and marks their chunks. pass_i.w: first layer.
#include "volume/voxel_mark.glsl"
layout(local_size_x = 8, local_size_y = 4, local_size_z = 2) in;
layout(binding = 12, r16f) uniform readonly image3D distance_real;

void main() {
  ivec3 at = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, frame.pass_i.w);
  int n = frame.grid.x;
  if (any(greaterThanEqual(at, ivec3(n, n, kCascades * n)))) return;
  float edge = frame.cascade[at.z / n].w;
  if (abs(imageLoad(distance_real, at).r) < min(2.0 * edge, 0.9 * frame.field.y)) take_voxel(at);
}
