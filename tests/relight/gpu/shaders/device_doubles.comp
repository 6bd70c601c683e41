#version 450
// Uses 64-bit floats, a feature that the device was created without: the validation layer must report an error.
layout(local_size_x = 8) in;
layout(std430, binding = 1) buffer Result { double values[]; };

void main() { values[gl_GlobalInvocationID.x] *= 3.0lf; }
