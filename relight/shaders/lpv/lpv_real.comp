#version 460
#extension GL_GOOGLE_include_directive : require
// Injects the indirect change of real surfaces (thesis eq. 5.12-5.13): the change of their reflected light, as stored
// in the listed voxels by the split-inject of reflective shadow maps and by the bounces. Every voxel is a Lambert
// emitter of the flux π L A. pass_f.x: fixed-point unit.
#include "volume/volume.glsl"
#include "volume/voxel_list.glsl"
#include "lpv/lpv_splat.glsl"
layout(local_size_x = 64) in;
layout(binding = 26, rgba16f) uniform readonly image3D change_real;  // radiance times weight, weight
layout(binding = 27, rgba16f) uniform readonly image3D normal_real;

void main() {
  for (uint i = gl_GlobalInvocationID.x; i < voxels_listed(); i += gl_NumWorkGroups.x * 64u) {
    Voxel voxel = listed_voxel(i);
    ivec3 texel = voxel_texel(kReal, voxel.cascade, voxel.place);
    vec4 change = imageLoad(change_real, texel);
    for (int once = 0; once < (change.rgb != vec3(0) ? 1 : 0); ++once) {
      vec3 n = imageLoad(normal_real, texel).xyz, flux = kPi * voxel.edge * voxel.edge * frame.pass_f.x * change.rgb;
      vec4 lambert = vec4(1.0, kLpvLambert * n);
      lpv_splat(voxel.cascade, voxel.position - real_distance(voxel.position) * n, n,
                mat3x4(flux.r * lambert, flux.g * lambert, flux.b * lambert));
    }
  }
}
