#version 450
// Integer atomics on a buffer and on a 3D image: the sums do not depend on the order.
layout(local_size_x = 64) in;

layout(std430, binding = 1) buffer Bins { uint bins[16]; };
layout(r32ui, binding = 2) uniform uimage3D cells;

void main() {
  uint i = gl_GlobalInvocationID.x;
  atomicAdd(bins[i % 16u], i);
  imageAtomicAdd(cells, ivec3(i % 2u, (i / 2u) % 2u, (i / 4u) % 2u), 1u);
}
