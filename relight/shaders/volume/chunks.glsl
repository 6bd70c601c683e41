// Storage that follows surfaces: what the volumes hold of them lies in chunks of 8³ texels, of every level of a hierarchy,
// that exist where a surface comes near. A table says which chunk is where; chunks lie in a texture, a pool, in which each
// has one more texel along every axis, a copy of what the next chunk begins with, so that the device filters within one.
// Chunk 0 holds nothing and stands for all that do not exist. Real and virtual surfaces have chunks of their own.
#ifndef CHUNKS_GLSL
#define CHUNKS_GLSL
#include "common/frame.glsl"

layout(std430, binding = 32) readonly buffer ChunkTable { uint chunk_table[]; };

const int kReal = 0, kVirtual = 1;

// In the table of one kind: level by level, then cascade by cascade, x fastest. Levels of 2^k texels along the edge sum up
// as a geometric series.
int chunk_place(int c, int level, ivec3 chunk) {
  int q = frame.grid.x >> 2, r = q >> level, e = max(r >> 1, 1);
  return 2 * (q * q * q - r * r * r) / 7 + chunk.x + e * (chunk.y + e * (chunk.z + e * c));
}
uint chunk_at(int kind, int c, int level, ivec3 chunk) {
  int q = frame.grid.x >> 2;
  return chunk_table[kind * (2 * (q * q * q - 1) / 7 + 2) + chunk_place(c, level, chunk)];
}
ivec3 chunk_texel(uint number) {
  const uint row = uint(kChunkRow);
  return (kChunkEdge + 1) * ivec3(number % row, number / row % row, number / (row * row));
}

// Of level 0: a voxel's texel in a pool, and its place in buffers of 8³ values a chunk.
ivec3 voxel_texel(int kind, int c, ivec3 voxel) {
  return chunk_texel(chunk_at(kind, c, 0, voxel >> 3)) + (voxel & 7);
}
uint voxel_value(int kind, int c, ivec3 voxel) {
  ivec3 at = voxel & 7;
  return chunk_at(kind, c, 0, voxel >> 3) * 512u + uint(at.x + 8 * (at.y + 8 * at.z));
}
// The texels that are to be written for a voxel: i = 0 is its own, others are copies in chunks below; x < 0: there is none.
const int kMostCopies = 8;
ivec3 voxel_copy(int kind, int c, ivec3 voxel, int i) {
  ivec3 o = ivec3(i & 1, i >> 1 & 1, i >> 2), at = voxel & 7, chunk = (voxel >> 3) - o;
  if (any(lessThan(chunk, ivec3(0))) || (at * o) != ivec3(0)) return ivec3(-1);
  uint number = chunk_at(kind, c, 0, chunk);
  return number == 0u ? ivec3(-1) : chunk_texel(number) + at + 8 * o;
}

// Linear between the texels of a level. `v` in voxels from the cascade's corner, half a texel or more inside.
vec4 chunk_linear(sampler3D pool, int kind, int c, vec3 v, int level) {
  vec3 g = v * exp2(-float(level)) - 0.5;
  ivec3 chunk = ivec3(g) >> 3;
  vec3 at = vec3(chunk_texel(chunk_at(kind, c, level, chunk)) - 8 * chunk) + g + 0.5;
  return textureLod(pool, at / vec3(textureSize(pool, 0)), 0.0);
}
#endif
