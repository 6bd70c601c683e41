// Voxels near surfaces, so that expensive passes run on these only. Their order varies between runs; no result depends
// on it.
#ifndef VOXEL_LIST_GLSL
#define VOXEL_LIST_GLSL
#include "common/frame.glsl"

layout(std430, binding = 28) buffer List {
  uint voxel_count;
  uint voxels[];  // 9 bits each of x and y, 10 of z in the texture of both cascades
};

struct Voxel {
  ivec3 at;       // in the dense texture of both cascades
  ivec3 place;    // in its own cascade
  int cascade;
  vec3 position;
  float edge;
};
uint voxels_listed() { return min(voxel_count, uint(voxels.length())); }
Voxel listed_voxel(uint i) {
  uint packed = voxels[i];
  Voxel v;
  v.at = ivec3(packed & 511u, packed >> 9 & 511u, packed >> 18 & 1023u);
  v.cascade = v.at.z / frame.grid.x;
  v.place = v.at - ivec3(0, 0, v.cascade * frame.grid.x);
  v.edge = frame.cascade[v.cascade].w;
  v.position = frame.cascade[v.cascade].xyz + v.edge * vec3(v.place);
  return v;
}
// Rotation of a voxel's sampling pattern: R3 sequence (Roberts 2018).
float voxel_turn(Voxel v) { return fract(dot(vec3(v.place), vec3(0.8191725, 0.6710436, 0.5497005))); }
void list_voxel(ivec3 at) {
  uint slot = atomicAdd(voxel_count, 1u);
  if (slot < uint(voxels.length())) voxels[slot] = uint(at.x) | uint(at.y) << 9 | uint(at.z) << 18;
}
#endif
