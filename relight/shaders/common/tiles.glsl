// Work on selected blocks of 8 × 8 texels: one workgroup per block.
#ifndef TILES_GLSL
#define TILES_GLSL
layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 29) readonly buffer Tiles { uint tiles[]; };
ivec2 tile_texel() {
  uint tile = tiles[gl_WorkGroupID.x];
  return 8 * ivec2(tile & 0xffffu, tile >> 16) + ivec2(gl_LocalInvocationID.xy);
}
#endif
