#version 460
#extension GL_GOOGLE_include_directive : require
// Antiradiance of the objects (thesis §5.3.2, "direct inject"; eq. 3.14): what the real room sends through the place of an
// object would leave it at the far side, and no longer does. Lamps are left out: their shadows are drawn by cones. So are
// objects behind: they end the light that falls on them themselves.
// In the listed voxels in front of virtual surfaces; pass_i.y: cones; pass_f.x: fixed-point unit.
#include "gather.glsl"
#include "voxel_list.glsl"
#include "lpv_splat.glsl"
#include "lpv_area.glsl"
layout(local_size_x = 64) in;

void main() {
  for (uint i = gl_GlobalInvocationID.x; i < voxels_listed(); i += gl_NumWorkGroups.x * 64u) {
    Voxel voxel = listed_voxel(i);
    vec3 n = virtual_normal(voxel.position);
    if (!voxel.is_virtual || dot(n, n) < 0.5) continue;
    Cone k;
    k.from_virtual = voxel.position - virtual_distance(voxel.position) * n;
    k.from_real = k.from_virtual - max(frame.cascade[0].w, 0.75 * frame.field.x) * n;
    mat3x4 light = mat3x4(0);
    for (int j = 0; j < frame.pass_i.y; ++j) {
      hemisphere_cone(-n, j, frame.pass_i.y, voxel_turn(voxel), k.w, k.tan_half);
      vec3 l = mu_cone(k);
      vec4 m = vec4(1.0, -k.w);
      light[0] += l.r * m;
      light[1] += l.g * m;
      light[2] += l.b * m;
    }
    float flux = -kPi / float(frame.pass_i.y) * lpv_virtual_area(voxel) * frame.pass_f.x;
    lpv_splat(voxel.cascade, k.from_virtual, n, flux * light);
  }
}
