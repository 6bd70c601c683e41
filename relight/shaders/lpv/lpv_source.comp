#version 460
#extension GL_GOOGLE_include_directive : require
// Converts the fixed-point sums to the source volumes. pass_f.y: value of a unit.
#include "lpv/lpv.glsl"
layout(local_size_x = 8, local_size_y = 4, local_size_z = 2) in;
layout(std430, binding = 15) readonly buffer OfVirtual { int of_virtual[]; };
layout(std430, binding = 16) readonly buffer OfReal { int of_real[]; };
layout(binding = 12, rgba32f) uniform writeonly image3D out_red;  // Φ, J
layout(binding = 13, rgba32f) uniform writeonly image3D out_green;
layout(binding = 14, rgba32f) uniform writeonly image3D out_blue;

vec4 sum_at(int i) {
  return frame.pass_f.y * vec4(ivec4(of_virtual[i], of_virtual[i + 1], of_virtual[i + 2], of_virtual[i + 3]) +
                               ivec4(of_real[i], of_real[i + 1], of_real[i + 2], of_real[i + 3]));
}

void main() {
  ivec3 at = ivec3(gl_GlobalInvocationID);
  int n = frame.pass_i.x;
  if (any(greaterThanEqual(at, ivec3(n, n, kCascades * n)))) return;
  int first = 12 * (at.x + n * (at.y + n * at.z));
  imageStore(out_red, at, sum_at(first));
  imageStore(out_green, at, sum_at(first + 4));
  imageStore(out_blue, at, sum_at(first + 8));
}
