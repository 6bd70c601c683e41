#version 460
// Arithmetic that occupies a device for some tenths of a millisecond.
layout(local_size_x = 64) in;
layout(std430, binding = 1) buffer Sink { float sink[]; };

void main() {
  float x = float(gl_GlobalInvocationID.x);
  for (int i = 0; i < 150000; ++i) x = fma(x, 0.99991, 0.5);
  if (x == 12345.678) sink[0] = x;  // never, but compilers do not know
}
