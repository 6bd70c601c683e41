// The grids of delta light propagation volumes: as many cells along an edge as pass_i.x, over each of the two cascades.
// Both lie in one texture, as those of volume.glsl do.
#ifndef LPV_GLSL
#define LPV_GLSL
#include "common/frame.glsl"
#include "lpv/lpv_kernel.h"

float lpv_cell_m(int c) { return frame.cascade[c].w * float(frame.grid.x) / float(frame.pass_i.x); }
vec3 lpv_low(int c) { return frame.cascade[c].xyz - 0.5 * frame.cascade[c].w; }
// In cells from the low corner; the centre of the first is at 0.5.
vec3 lpv_place(int c, vec3 p) { return (p - lpv_low(c)) / lpv_cell_m(c); }
vec3 lpv_axis(int face) {  // 0 to 5: +x, -x, +y, -y, +z, -z
  vec3 e = vec3(face / 2 == 0, face / 2 == 1, face / 2 == 2);
  return face % 2 == 0 ? e : -e;
}
#endif
