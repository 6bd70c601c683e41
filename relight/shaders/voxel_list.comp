#version 460
#extension GL_GOOGLE_include_directive : require
// Voxels of one cascade (pass_i.x) whose light is gathered for the next bounce: all at virtual surfaces, and those at
// real surfaces from which the objects fill more than pass_f.x of the hemisphere. Their order differs from run to run;
// nothing depends on it.
#include "volume.glsl"
layout(local_size_x = 8, local_size_y = 4, local_size_z = 2) in;
layout(std430, binding = 16) buffer List { uint count; uint voxels[]; };  // 9 bits each; bit 30: virtual, bit 31: real
layout(binding = 25, rgba16f) uniform readonly image3D weight_real;
layout(binding = 26, rgba16f) uniform readonly image3D albedo_real;

void main() {
  ivec3 at = ivec3(gl_GlobalInvocationID);
  int n = frame.grid.x;
  if (any(greaterThanEqual(at, ivec3(n)))) return;
  vec4 cascade = frame.cascade[frame.pass_i.x];
  vec3 p = cascade.xyz + cascade.w * vec3(at);
  bool is_virtual = abs(virtual_distance(p)) < cascade.w;
  bool is_real = false;
  if (imageLoad(weight_real, at).a > 0.0 && imageLoad(albedo_real, at).a > 0.0) {
    vec3 to = frame.sphere.xyz - p;
    is_real = frame.sphere.w * frame.sphere.w > frame.pass_f.x * dot(to, to);
  }
  if (!is_virtual && !is_real) return;
  uint place = atomicAdd(count, 1u);
  if (place < uint(voxels.length()))
    voxels[place] = uint(at.x) | uint(at.y) << 9 | uint(at.z) << 18 | (is_virtual ? 1u << 30 : 0u) | (is_real ? 1u << 31 : 0u);
}
