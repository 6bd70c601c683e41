#version 460
#extension GL_GOOGLE_include_directive : require
// One more bounce (thesis eq. 3.13): virtual surfaces in the listed voxels gather the changed scene and the environment
// from the current volumes.
#include "volume/gather.glsl"
#include "volume/mirror_lamp.glsl"
#include "volume/voxel_list.glsl"
#include "common/slice.glsl"
#include "common/half.glsl"
layout(binding = 17) uniform sampler3D virtual_reflectance;
layout(binding = 18, rgba16f) uniform writeonly image3D gathered;

void main() {
  for (uint i = slice_first(); i < voxels_listed(); i += slice_stride()) {
    Voxel voxel = listed_voxel(i);
    vec3 n = virtual_normal(voxel.position);
    if (dot(n, n) < 0.5) continue;
    vec3 on = voxel.position - virtual_distance(voxel.position) * n;
    vec3 uvw = (on - grid_low(frame.virtual_grid)) / (vec3(frame.grid.yzw) * frame.virtual_grid.w);
    vec3 reflectance = textureLod(virtual_reflectance, uvw, 0.0).rgb;
    Cone k;
    k.from_real = on;
    k.from_virtual = on + 1.5 * frame.virtual_grid.w * n;
    vec3 e = gather_rho(k.from_real, k.from_virtual, n, frame.counts.z, voxel_turn(voxel)) +
             mirrored_irradiance(on, n, k, frame.counts.w, voxel_turn(voxel));
    imageStore(gathered, voxel_texel(kVirtual, voxel.cascade, voxel.place), to_half(vec4(reflectance * e / kPi, 1.0)));
  }
}
