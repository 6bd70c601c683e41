#version 450
// Declares slot 2 and the parameters without using them.
layout(local_size_x = 8) in;
layout(std140, binding = 0) uniform Params { vec4 value; } params;
layout(std430, binding = 1) writeonly buffer Result { uint result[]; };
layout(binding = 2) uniform sampler2D unused;

void main() { result[gl_GlobalInvocationID.x] = gl_GlobalInvocationID.x; }
