#version 450
// Writes a field that is linear in space, which trilinear filtering must reproduce exactly.
layout(local_size_x = 8, local_size_y = 2, local_size_z = 2) in;

layout(std140, binding = 0) uniform Params { vec4 slope; } params;
layout(rgba32f, binding = 1) writeonly uniform image3D volume;

void main() {
  ivec3 cell = ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(cell, imageSize(volume)))) return;
  vec3 center = vec3(cell) + 0.5;
  imageStore(volume, cell, vec4(dot(center, params.slope.xyz) + params.slope.w, center));
}
