// Sparse storage near surfaces: chunks of 8³ texels, at every level of a hierarchy, allocated where there is a surface
// nearby. A table maps positions to chunks; chunks are stored in a texture, the pool, each with one more texel along
// every axis that copies the next chunk's first, so that hardware filtering works inside one chunk. Chunk 0 is empty
// and represents all unallocated ones. Real and virtual surfaces have separate chunks.
#ifndef CHUNKS_GLSL
#define CHUNKS_GLSL
#include "common/frame.glsl"

layout(std430, binding = 32) readonly buffer ChunkTable { uint chunk_table[]; };

const int kReal = 0, kVirtual = 1;

// Index into the table of one kind: ordered by level, then cascade, x fastest. The number of chunks of the levels,
// which have 2^k along the edge, is a geometric series.
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

// At level 0: a voxel's texel in a pool, and its index in buffers of 8³ values per chunk.
ivec3 voxel_texel(int kind, int c, ivec3 voxel) {
  return chunk_texel(chunk_at(kind, c, 0, voxel >> 3)) + (voxel & 7);
}
uint voxel_value(int kind, int c, ivec3 voxel) {
  ivec3 at = voxel & 7;
  return chunk_at(kind, c, 0, voxel >> 3) * 512u + uint(at.x + 8 * (at.y + 8 * at.z));
}
// The texels to write for a voxel: i = 0 is its own, the others are copies in the preceding chunks; x < 0: none.
const int kMaxCopies = 8;
ivec3 voxel_copy(int kind, int c, ivec3 voxel, int i) {
  ivec3 o = ivec3(i & 1, i >> 1 & 1, i >> 2), at = voxel & 7, chunk = (voxel >> 3) - o;
  if (any(lessThan(chunk, ivec3(0))) || (at * o) != ivec3(0)) return ivec3(-1);
  uint number = chunk_at(kind, c, 0, chunk);
  return number == 0u ? ivec3(-1) : chunk_texel(number) + at + 8 * o;
}

// Linear interpolation between the texels of a level. `v` in voxels from the cascade's corner, at least half a texel
// inside.
vec4 chunk_linear(sampler3D pool, int kind, int c, vec3 v, int level) {
  vec3 g = v * exp2(-float(level)) - 0.5;
  ivec3 chunk = ivec3(g) >> 3;
  vec3 at = vec3(chunk_texel(chunk_at(kind, c, level, chunk)) - 8 * chunk) + g + 0.5;
  return textureLod(pool, at / vec3(textureSize(pool, 0)), 0.0);
}
#endif
