// Area of the virtual surface that a voxel in front of it stands for, m². The weights of such voxels measure the surface
// a little outside of the true one; around the voxel their sum is set right by that of the area that was split over them.
#ifndef LPV_AREA_GLSL
#define LPV_AREA_GLSL
#include "voxel_list.glsl"
layout(std430, binding = 15) readonly buffer Area { int virtual_area[]; };  // voxel faces, times 1 / pass_f.z
layout(binding = 25, rgba16f) uniform readonly image3D virtual_light;       // radiance times weight, weight

float lpv_virtual_area(Voxel voxel) {
  int n = frame.grid.x;
  float area = 0.0, weight = 0.0;
  for (int j = 0; j < 27; ++j) {
    ivec3 o = ivec3(j % 3, (j / 3) % 3, j / 9) - 1, v = voxel.place + o;
    if (any(lessThan(v, ivec3(0))) || any(greaterThanEqual(v, ivec3(n)))) continue;
    float k = (o.x == 0 ? 2.0 : 1.0) * (o.y == 0 ? 2.0 : 1.0) * (o.z == 0 ? 2.0 : 1.0);
    area += k * float(virtual_area[v.x + n * (v.y + n * (v.z + n * voxel.cascade))]) * frame.pass_f.z;
    weight += k * imageLoad(virtual_light, voxel.at + o).a;
  }
  float ratio = weight > 0.0 ? clamp(area / weight, 0.0, 2.0) : 0.0;
  return ratio * imageLoad(virtual_light, voxel.at).a * voxel.edge * voxel.edge;
}
#endif
