#version 460
#extension GL_GOOGLE_include_directive : require
// The next level of a volume's hierarchy: the mean of eight. Values are premultiplied by their weight, so the mean of a
// signed change is filtered exactly as the radiance it changes.
#include "half.glsl"
layout(local_size_x = 8, local_size_y = 4, local_size_z = 2) in;
layout(binding = 1, rgba16f) uniform readonly image3D fine;
layout(binding = 2, rgba16f) uniform writeonly image3D coarse;

void main() {
  ivec3 at = ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(at, imageSize(coarse)))) return;
  vec4 sum = vec4(0);
  for (int i = 0; i < 8; ++i) sum += imageLoad(fine, 2 * at + ivec3(i & 1, (i >> 1) & 1, i >> 2));
  imageStore(coarse, at, to_half(sum * 0.125));
}
