#version 460
#extension GL_GOOGLE_include_directive : require
// Blends the change of irradiance of real cells from one round of gathering to the next, on the cells of the newer one.
// pass_f, pass_g: cascades of the older round, as FrameParams.cascade; pass_m[0][0]: weight of the newer.
#include "common/frame.glsl"
#include "common/half.glsl"
layout(local_size_x = 8, local_size_y = 4, local_size_z = 2) in;
layout(binding = 1) uniform sampler3D older;  // times weight, weight
layout(binding = 2, rgba16f) uniform readonly image3D newer;
layout(binding = 3, rgba16f) uniform writeonly image3D mixed;

void main() {
  ivec3 at = ivec3(gl_GlobalInvocationID);
  int n = frame.grid.x / 2, c = at.z / n;
  if (any(greaterThanEqual(at, ivec3(n, n, kCascades * n)))) return;
  vec4 to = frame.cascade[c], from = c == 0 ? frame.pass_f : frame.pass_g;
  // The cell's centre in cells of the older cascade, whose texel centres are at integers plus a half.
  vec3 v = (to.xyz + to.w * (2.0 * vec3(at.xy, at.z - c * n) + 0.5) - from.xyz + 0.5 * from.w) / (2.0 * from.w);
  vec3 inside = clamp(v, vec3(0.5), vec3(float(n) - 0.5));
  vec4 before = textureLod(older, (inside + vec3(0.0, 0.0, float(c * n))) / vec3(n, n, kCascades * n), 0.0);
  imageStore(mixed, at, to_half(mix(before, imageLoad(newer, at), frame.pass_m[0][0])));
}
