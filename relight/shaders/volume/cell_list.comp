#version 460
#extension GL_GOOGLE_include_directive : require
// Lists the cells with real surface that are near enough to the objects for their light to change: the objects cover
// more than the fraction pass_f.x of the hemisphere there.
#include "volume/chunks.glsl"
#include "volume/cells.glsl"
layout(local_size_x = 8, local_size_y = 4, local_size_z = 2) in;
layout(binding = 1, rgba16f) uniform readonly image3D weight_real;  // L_mu, its a is the surface weight

void main() {
  ivec3 at = ivec3(gl_GlobalInvocationID);
  int n = frame.grid.x / 2;
  if (any(greaterThanEqual(at, ivec3(n, n, kCascades * n)))) return;
  vec4 cascade = frame.cascade[at.z / n];
  vec3 to = frame.sphere.xyz - (cascade.xyz + cascade.w * (2.0 * vec3(at.xy, at.z % n) + 0.5));
  ivec3 first = voxel_texel(kReal, at.z / n, 2 * ivec3(at.xy, at.z % n));
  float weight = 0.0;
  for (int i = 0; i < 8; ++i) weight += imageLoad(weight_real, first + ivec3(i & 1, (i >> 1) & 1, i >> 2)).a;
  if (weight > 0.0 && frame.sphere.w * frame.sphere.w > frame.pass_f.x * dot(to, to)) list_cell(at);
}
