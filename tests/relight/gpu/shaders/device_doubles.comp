#version 450
// Asks for 64-bit floats, which the device was not opened with: the validation layer must say so.
layout(local_size_x = 8) in;
layout(std430, binding = 1) buffer Result { double values[]; };

void main() { values[gl_GlobalInvocationID.x] *= 3.0lf; }
