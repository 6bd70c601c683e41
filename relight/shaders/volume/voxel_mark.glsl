// Marks a voxel that contains part of a surface, and the chunks that it needs.
#ifndef VOXEL_MARK_GLSL
#define VOXEL_MARK_GLSL
#include "volume/chunks.glsl"
#include "volume/voxel_list.glsl"
layout(std430, binding = 33) writeonly buffer Marks { uint marks[]; };  // same layout as the table of chunks; 1: needed

// Filtering reads the neighbour below a texel. At level 0 voxels read all of their neighbours.
void take_voxel(ivec3 at) {
  list_voxel(at);
  int n = frame.grid.x, c = at.z / n;
  ivec3 voxel = at - ivec3(0, 0, c * n);
  for (int level = 0; level < frame.counts2.w; ++level) {
    ivec3 texel = voxel >> level, low = max(texel - 1, ivec3(0)) >> 3,
          high = min(texel + (level == 0 ? 1 : 0), ivec3(n - 1)) >> 3;
    for (int z = low.z; z <= high.z; ++z)
      for (int y = low.y; y <= high.y; ++y)
        for (int x = low.x; x <= high.x; ++x) marks[chunk_place(c, level, ivec3(x, y, z))] = 1u;
  }
}
#endif
