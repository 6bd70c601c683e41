#version 450
// Computes a mip from the previous one of the same texture.
layout(local_size_x = 8, local_size_y = 2, local_size_z = 2) in;

layout(rgba32f, binding = 1) readonly uniform image3D fine;
layout(rgba32f, binding = 2) writeonly uniform image3D coarse;

void main() {
  ivec3 cell = ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(cell, imageSize(coarse)))) return;
  vec4 sum = vec4(0);
  for (int i = 0; i < 8; ++i) sum += imageLoad(fine, 2 * cell + ivec3(i & 1, (i >> 1) & 1, i >> 2));
  imageStore(coarse, cell, sum / 8.0);
}
