#version 460
#extension GL_GOOGLE_include_directive : require
// Converts flux sums and gathered light to radiance in the listed voxels. Radiance of a Lambert surface is flux / (π
// area). Virtual areas are split over voxels like the flux; real ones follow from the distance field by the coarea
// formula with a hat function of one voxel to either side, whose sum over the lattice is the surface's area. Flux and
// area are averaged alike over 3³ voxels, so sparse shadow-map texels leave no holes.
#include "volume/volume.glsl"
#include "volume/voxel_list.glsl"
#include "common/half.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 16) readonly buffer VirtualFlux { int virtual_flux[]; };  // chunk, voxel, channel
layout(std430, binding = 17) readonly buffer RealFlux { int real_flux[]; };
layout(std430, binding = 15) readonly buffer Area { int virtual_area[]; };
layout(binding = 18, rgba16f) uniform readonly image3D gathered_virtual;  // radiance from bounces
layout(binding = 19) uniform sampler3D real_irradiance;  // its change by bounces, times weight, weight
layout(binding = 14, rgba16f) uniform readonly image3D albedo_real;
layout(binding = 25, rgba16f) uniform readonly image3D weight_real;  // L_mu, its a is the surface weight
layout(binding = 26, rgba16f) uniform writeonly image3D out_virtual;
layout(binding = 27, rgba16f) uniform writeonly image3D out_change;

const float kMinArea = 0.05;  // voxel faces; voxels with less area are ignored

void main() {
  int n = frame.grid.x;
  for (uint i = gl_GlobalInvocationID.x; i < voxels_listed(); i += gl_NumWorkGroups.x * 64u) {
    Voxel voxel = listed_voxel(i);
    float w_virtual = front_weight(virtual_distance(voxel.position), voxel.edge);
    ivec3 of_real = voxel_texel(kReal, voxel.cascade, voxel.place),
          of_virtual = voxel_texel(kVirtual, voxel.cascade, voxel.place);
    vec4 mu = imageLoad(weight_real, of_real);
    vec3 flux_v = vec3(0), flux_r = vec3(0);
    float area_v = 0.0, area_r = 0.0;
    for (int j = 0; j < 27; ++j) {
      ivec3 o = ivec3(j % 3, (j / 3) % 3, j / 9) - 1, v = voxel.place + o;
      if (any(lessThan(v, ivec3(0))) || any(greaterThanEqual(v, ivec3(n)))) continue;
      float k = (o.x == 0 ? 2.0 : 1.0) * (o.y == 0 ? 2.0 : 1.0) * (o.z == 0 ? 2.0 : 1.0);
      uint of_v = voxel_value(kVirtual, voxel.cascade, v), of_r = voxel_value(kReal, voxel.cascade, v);
      flux_v += k * vec3(virtual_flux[3u * of_v], virtual_flux[3u * of_v + 1u], virtual_flux[3u * of_v + 2u]);
      flux_r += k * vec3(real_flux[3u * of_r], real_flux[3u * of_r + 1u], real_flux[3u * of_r + 2u]);
      area_v += k * float(virtual_area[of_v]) * frame.pass_f.x;
      area_r += k * imageLoad(weight_real, voxel_texel(kReal, voxel.cascade, v)).a;
    }
    float unit = frame.field.w / (kPi * voxel.edge * voxel.edge);
    vec4 out_v = vec4(0), out_r = vec4(0);
    if (w_virtual > 0.0)
      out_v = vec4(flux_v * unit / max(area_v, kMinArea) + imageLoad(gathered_virtual, of_virtual).rgb, 1.0) * w_virtual;
    if (mu.a > 0.0) {
      vec4 e = textureLod(real_irradiance, cascade_place(voxel.cascade, voxel.position, 1.0), 0.0);
      vec3 gathered = e.a > 1e-3 ? imageLoad(albedo_real, of_real).rgb * e.rgb / (kPi * e.a) : vec3(0);
      vec3 change = (flux_r * unit / area_r + gathered) * mu.a;
      out_r = vec4(max(change, -mu.rgb), mu.a);  // radiance cannot become negative
    }
    for (int j = 0; j < kMaxCopies; ++j) {
      ivec3 texel = voxel_copy(kVirtual, voxel.cascade, voxel.place, j);
      if (texel.x >= 0) imageStore(out_virtual, texel, to_half(out_v));
      texel = voxel_copy(kReal, voxel.cascade, voxel.place, j);
      if (texel.x >= 0) imageStore(out_change, texel, to_half(out_r));
    }
  }
}
