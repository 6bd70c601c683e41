// Cells of 2³ voxels that contain real surface: quantities that vary slowly over it are gathered once per cell.
#ifndef CELLS_GLSL
#define CELLS_GLSL
#include "common/frame.glsl"

layout(std430, binding = 28) buffer Cells {
  uint cell_count;
  uint cells[];  // 8 bits of x, 8 of y, 9 of z in the texture of both cascades
};

uint cells_listed() { return min(cell_count, uint(cells.length())); }
ivec3 listed_cell(uint i) {
  uint packed = cells[i];
  return ivec3(packed & 255u, packed >> 8 & 255u, packed >> 16);
}
void list_cell(ivec3 at) {
  uint slot = atomicAdd(cell_count, 1u);
  if (slot < uint(cells.length())) cells[slot] = uint(at.x) | uint(at.y) << 8 | uint(at.z) << 16;
}
#endif
