#version 460
#extension GL_GOOGLE_include_directive : require
// Injects the effect of virtual surfaces, in the listed voxels in front of them. Reflection (thesis eq. 5.12): a
// Lambert emitter of the flux π L A. Occlusion (thesis §5.3.2, "direct inject"; eq. 3.14): light of the real room that
// passed through the object's location would leave on the far side; it is subtracted there. Excluded are lamps, whose
// shadows other passes compute, and objects behind, which absorb their incident light themselves. pass_i.y: cones;
// pass_i.z: 1 if `gathered` is to be added; pass_f.x: fixed-point unit.
#include "volume/gather.glsl"
#include "volume/voxel_list.glsl"
#include "lpv/lpv_splat.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 15) readonly buffer Area { int virtual_area[]; };  // voxel faces, times 1 / pass_f.z
layout(binding = 25, rgba16f) uniform readonly image3D virtual_light;       // radiance times weight, weight
layout(binding = 26, rgba16f) uniform readonly image3D gathered;            // radiance

// Area of the surface that a voxel in front of it represents, m². The weights of such voxels measure the area slightly
// outside the true surface; their sum around the voxel is rescaled to that of the area that was split over them.
float area_of(Voxel voxel, float own_weight) {
  int n = frame.grid.x;
  float area = 0.0, weight = 0.0;
  for (int j = 0; j < 27; ++j) {
    ivec3 o = ivec3(j % 3, (j / 3) % 3, j / 9) - 1, v = voxel.place + o;
    if (any(lessThan(v, ivec3(0))) || any(greaterThanEqual(v, ivec3(n)))) continue;
    float k = (o.x == 0 ? 2.0 : 1.0) * (o.y == 0 ? 2.0 : 1.0) * (o.z == 0 ? 2.0 : 1.0);
    area += k * float(virtual_area[voxel_value(kVirtual, voxel.cascade, v)]) * frame.pass_f.z;
    weight += k * imageLoad(virtual_light, voxel_texel(kVirtual, voxel.cascade, v)).a;
  }
  return (weight > 0.0 ? clamp(area / weight, 0.0, 2.0) : 0.0) * own_weight * voxel.edge * voxel.edge;
}

void main() {
  for (uint i = gl_GlobalInvocationID.x; i < voxels_listed(); i += gl_NumWorkGroups.x * 64u) {
    Voxel voxel = listed_voxel(i);
    ivec3 texel = voxel_texel(kVirtual, voxel.cascade, voxel.place);
    vec4 lit = imageLoad(virtual_light, texel);
    // A loop that is not entered costs nothing on software devices, unlike a branch.
    for (int once = 0; once < (lit.a > 0.0 ? 1 : 0); ++once) {
      vec3 n = virtual_normal(voxel.position), l = lit.rgb / lit.a;
      if (frame.pass_i.z == 1) l += imageLoad(gathered, texel).rgb;
      vec4 lambert = vec4(1.0, kLpvLambert * n);
      mat3x4 light = mat3x4(l.r * lambert, l.g * lambert, l.b * lambert);
      vec3 from_virtual = voxel.position - virtual_distance(voxel.position) * n;
      vec3 from_real = from_virtual - cone_start_m() * n;
      for (int j = 0; j < frame.pass_i.y; ++j) {
        Cone k = hemisphere_cone(from_real, from_virtual, -n, j, frame.pass_i.y, voxel_turn(voxel));
        vec3 hidden = frame.blocked.rgb * mu_cone(k) / float(frame.pass_i.y);
        vec4 beam = vec4(1.0, -k.w);
        light -= mat3x4(hidden.r * beam, hidden.g * beam, hidden.b * beam);
      }
      float area = dot(n, n) > 0.5 ? area_of(voxel, lit.a) : 0.0;
      lpv_splat(voxel.cascade, from_virtual, n, kPi * area * frame.pass_f.x * light);
    }
  }
}
