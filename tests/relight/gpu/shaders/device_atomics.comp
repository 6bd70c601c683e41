#version 450
// Integer atomics on two buffers: the sums do not depend on the order.
layout(local_size_x = 64) in;

layout(std430, binding = 1) buffer Bins { uint bins[16]; };
layout(std430, binding = 2) buffer Cells { uint cells[8]; };

void main() {
  uint i = gl_GlobalInvocationID.x;
  atomicAdd(bins[i % 16u], i);
  atomicAdd(cells[i % 8u], 1u);
}
