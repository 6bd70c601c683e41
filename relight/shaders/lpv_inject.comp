#version 460
#extension GL_GOOGLE_include_directive : require
// Indirect change (thesis eq. 5.12-5.13): what virtual surfaces reflect, and what real ones reflect more or less than
// before, as the split-inject of reflective shadow maps and the bounces left it in the listed voxels. Every voxel is a
// Lambert light of the flux π L A. pass_f.x: fixed-point unit.
#include "volume.glsl"
#include "voxel_list.glsl"
#include "lpv_splat.glsl"
#include "lpv_area.glsl"
layout(local_size_x = 64) in;
layout(binding = 26, rgba16f) uniform readonly image3D real_light_change;  // radiance times weight, weight
layout(binding = 27, rgba16f) uniform readonly image3D normal_real;

void inject(int c, vec3 p, vec3 n, vec3 flux) {
  vec4 m = vec4(1.0, kLpvLambert * n);
  flux *= frame.pass_f.x;
  lpv_splat(c, p, n, mat3x4(flux.r * m, flux.g * m, flux.b * m));
}

void main() {
  for (uint i = gl_GlobalInvocationID.x; i < voxels_listed(); i += gl_NumWorkGroups.x * 64u) {
    Voxel voxel = listed_voxel(i);
    float face = voxel.edge * voxel.edge;
    vec4 lit = imageLoad(virtual_light, voxel.at);
    if (voxel.is_virtual && lit.a > 0.0 && lit.rgb != vec3(0)) {
      vec3 n = virtual_normal(voxel.position);
      vec3 on = voxel.position - virtual_distance(voxel.position) * n;
      inject(voxel.cascade, on, n, kPi * lit.rgb / lit.a * lpv_virtual_area(voxel));
    }
    vec4 change = imageLoad(real_light_change, voxel.at);
    if (voxel.is_real && change.a > 0.0 && change.rgb != vec3(0)) {
      vec3 n = imageLoad(normal_real, voxel.at).xyz;
      vec3 on = voxel.position - real_distance(voxel.position) * n;
      inject(voxel.cascade, on, n, kPi * face * change.rgb);
    }
  }
}
