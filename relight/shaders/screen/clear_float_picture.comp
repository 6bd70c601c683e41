#version 460
// Clears a picture to 0. Stores beyond its edges have no effect.
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 1, rgba32f) uniform writeonly image2D target;

void main() { imageStore(target, ivec2(gl_GlobalInvocationID.xy), vec4(0.0)); }
