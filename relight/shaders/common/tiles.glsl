// Work on selected blocks of 8 × 8 texels: one workgroup per block.
#ifndef TILES_GLSL
#define TILES_GLSL
layout(std430, binding = 29) readonly buffer Tiles { uint tiles[]; };
ivec2 tile_texel() {
  uint tile = tiles[gl_WorkGroupID.x];
  return 8 * ivec2(tile & 0xffffu, tile >> 16) + ivec2(gl_LocalInvocationID.xy);
}
#endif
