#version 460
#extension GL_GOOGLE_include_directive : require
// Properties of the real surface in the listed voxels: measured radiance L_mu (which contains all bounces of the real
// room), albedo, normal.
#include "common/bricks.glsl"
#include "common/slice.glsl"
#include "volume/chunks.glsl"
#include "volume/voxel_list.glsl"
#include "common/half.glsl"
#include "common/unoccluded_irradiance.glsl"
layout(binding = 1, r16f) uniform image3D distance_m;
layout(binding = 2, rgba16f) uniform writeonly image3D out_radiance;  // rgb times weight, weight
layout(binding = 3, rgba16f) uniform writeonly image3D out_albedo;    // rgb, known
layout(binding = 4, rgba16f) uniform writeonly image3D out_normal;    // and distance
layout(binding = 5, rgba16f) uniform writeonly image3D out_response;  // ρ/π over radiance; times weight, weight

void main() {
  for (uint i = slice_first(); i < voxels_listed(); i += slice_stride()) {
    Voxel voxel = listed_voxel(i);
    float d;
    vec3 g;
    if (!field_distance(voxel.position, d) || !field_gradient(voxel.position, d, g)) continue;
    float slope = length(g);
    // Fused distances are measured along viewing rays; near the surface this converts them to Euclidean.
    d /= clamp(slope, 0.25, 1.25);
    imageStore(distance_m, voxel.at, vec4(to_half(d)));
    float weight = max(0.0, 1.0 - abs(d) / voxel.edge);
    vec4 radiance = vec4(0), albedo = vec4(0), response = vec4(0);
    if (weight > 0.0) {
      vec3 on = voxel.position - d * g / slope;
      radiance = field_radiance(on);
      albedo = field_albedo(on);
      // What clips in all frames has albedo, and no measured radiance.
      if (radiance.a == 0.0 && albedo.a > 0.0) radiance = vec4(albedo.rgb / kPi * open_irradiance(on, g / slope), 1.0);
      if (radiance.a > 0.0 && albedo.a > 0.0)
        response = vec4(albedo.rgb / kPi / max(radiance.rgb, vec3(1e-4)) * weight, weight);
      radiance = radiance.a > 0.0 ? vec4(radiance.rgb * weight, weight) : vec4(0);
      albedo = albedo.a > 0.0 ? vec4(albedo.rgb, 1.0) : vec4(0);
    }
    for (int j = 0; j < kMaxCopies; ++j) {
      ivec3 texel = voxel_copy(kReal, voxel.cascade, voxel.place, j);
      if (texel.x < 0) continue;
      imageStore(out_radiance, texel, to_half(radiance));
      imageStore(out_albedo, texel, to_half(albedo));
      imageStore(out_normal, texel, to_half(vec4(g / slope, d)));
      imageStore(out_response, texel, to_half(response));
    }
  }
}
