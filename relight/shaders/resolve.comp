#version 460
#extension GL_GOOGLE_include_directive : require
// Flux sums and gathered light become radiance in the volumes of one cascade (pass_i.x). Radiance of a Lambert surface
// is flux / (π area); the area inside a voxel follows from the distance field by the coarea formula with a hat of one
// voxel to either side, whose sum over the lattice is the surface's area. Flux and area are averaged alike over 3³
// voxels, so sparse shadow-map texels leave no holes.
#include "volume.glsl"
#include "half.glsl"
layout(local_size_x = 8, local_size_y = 4, local_size_z = 2) in;
layout(std430, binding = 16) readonly buffer VirtualFlux { int virtual_flux[]; };
layout(std430, binding = 17) readonly buffer RealFlux { int real_flux[]; };
layout(binding = 18, rgba16f) uniform readonly image3D gathered_virtual;  // radiance from bounces
layout(binding = 19, rgba16f) uniform readonly image3D gathered_real;
layout(binding = 25, rgba16f) uniform readonly image3D weight_real;  // L_mu of this cascade, its a is the surface weight
layout(binding = 26, rgba16f) uniform writeonly image3D out_virtual;
layout(binding = 27, rgba16f) uniform writeonly image3D out_change;

float hat(float d, float voxel) { return max(0.0, 1.0 - abs(d) / voxel); }
vec3 position_of(ivec3 v) { return frame.cascade[frame.pass_i.x].xyz + frame.cascade[frame.pass_i.x].w * vec3(v); }

void main() {
  ivec3 at = ivec3(gl_GlobalInvocationID);
  int n = frame.grid.x, c = frame.pass_i.x;
  if (any(greaterThanEqual(at, ivec3(n)))) return;
  float voxel = frame.cascade[c].w;
  float w_virtual = hat(virtual_distance(position_of(at)), voxel);
  vec4 mu = imageLoad(weight_real, at);
  vec4 out_v = vec4(0), out_r = vec4(0);
  if (w_virtual > 0.0 || mu.a > 0.0) {
    vec3 flux_v = vec3(0), flux_r = vec3(0);
    float area_v = 0.0, area_r = 0.0;
    for (int i = 0; i < 27; ++i) {
      ivec3 o = ivec3(i % 3, (i / 3) % 3, i / 9) - 1, v = at + o;
      if (any(lessThan(v, ivec3(0))) || any(greaterThanEqual(v, ivec3(n)))) continue;
      float k = (o.x == 0 ? 2.0 : 1.0) * (o.y == 0 ? 2.0 : 1.0) * (o.z == 0 ? 2.0 : 1.0);
      int f = 3 * (v.x + n * (v.y + n * (v.z + n * c)));
      if (w_virtual > 0.0) {
        flux_v += k * vec3(virtual_flux[f], virtual_flux[f + 1], virtual_flux[f + 2]);
        area_v += k * hat(virtual_distance(position_of(v)), voxel);
      }
      if (mu.a > 0.0) {
        flux_r += k * vec3(real_flux[f], real_flux[f + 1], real_flux[f + 2]);
        area_r += k * imageLoad(weight_real, v).a;
      }
    }
    float unit = frame.field.w / (kPi * voxel * voxel);
    if (w_virtual > 0.0) {
      vec3 radiance = flux_v * unit / area_v + imageLoad(gathered_virtual, at).rgb;
      out_v = vec4(radiance * w_virtual, w_virtual);
    }
    if (mu.a > 0.0) {
      vec3 change = (flux_r * unit / area_r + imageLoad(gathered_real, at).rgb) * mu.a;
      out_r = vec4(max(change, -mu.rgb), mu.a);  // no surface sends out less than nothing
    }
  }
  imageStore(out_virtual, at, to_half(out_v));
  imageStore(out_change, at, to_half(out_r));
}
