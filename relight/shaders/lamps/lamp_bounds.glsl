// Minimum and maximum depth of square blocks of a lamp's map, of four sizes: points in front of or behind a whole block
// need no comparison with its texels. Sixteen bits each, minimum << 16, rounded outwards.
#ifndef LAMP_BOUNDS_GLSL
#define LAMP_BOUNDS_GLSL
const int kBoundShift = 2, kBoundBlock = 1 << kBoundShift, kBoundLevels = 4;
const float kBoundScale = 65535.0;

// Index of a level's first block in a map, and so the number of blocks before level kBoundLevels.
int bound_level(int edge, int level) {
  int all = (edge * edge) >> 4;
  return level > 2 ? all + (all >> 2) + (all >> 4) : level > 1 ? all + (all >> 2) : level > 0 ? all : 0;
}
#endif
