#version 460
// Clears a volume to 0. Stores beyond its edges have no effect.
layout(local_size_x = 8, local_size_y = 4, local_size_z = 2) in;
layout(binding = 1, rgba32f) uniform writeonly image3D target;

void main() { imageStore(target, ivec3(gl_GlobalInvocationID), vec4(0.0)); }
