// The grids of delta light propagation volumes: pass_i.x cells along an edge, over each of the two cascades, which are
// stacked in one texture like those of volume.glsl.
#ifndef LPV_GLSL
#define LPV_GLSL
#include "common/frame.glsl"
#include "lpv/lpv_kernel.h"

float lpv_cell_m(int c) { return frame.cascade[c].w * float(frame.grid.x) / float(frame.pass_i.x); }
vec3 lpv_low(int c) { return frame.cascade[c].xyz - 0.5 * frame.cascade[c].w; }
// Position in cells from the low corner; the centre of the first cell is at 0.5.
vec3 lpv_place(int c, vec3 p) { return (p - lpv_low(c)) / lpv_cell_m(c); }
vec3 lpv_axis(int face) {  // 0 to 5: +x, -x, +y, -y, +z, -z
  vec3 e = vec3(face / 2 == 0, face / 2 == 1, face / 2 == 2);
  return face % 2 == 0 ? e : -e;
}
#endif
