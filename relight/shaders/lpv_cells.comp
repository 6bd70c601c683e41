#version 460
#extension GL_GOOGLE_include_directive : require
// Change of the irradiance on real surfaces, once in every listed cell: where it is reflected from (the next bounce), and
// where the live setting takes it from.
#include "lpv_query.glsl"
#include "cells.glsl"
#include "half.glsl"
layout(local_size_x = 64) in;
layout(binding = 18, rgba16f) uniform writeonly image3D irradiance;  // times weight, weight
layout(binding = 25, rgba16f) uniform readonly image3D weight_real;  // L_mu, its a is the surface weight
layout(binding = 26, rgba16f) uniform readonly image3D normal_real;

void main() {
  int m = frame.grid.x / 2;
  for (uint i = gl_GlobalInvocationID.x; i < cells_listed(); i += gl_NumWorkGroups.x * 64u) {
    ivec3 at = listed_cell(i);
    vec4 cascade = frame.cascade[at.z / m];
    vec3 low = cascade.xyz + cascade.w * 2.0 * vec3(at.xy, at.z % m), p = vec3(0), n = vec3(0);
    float weight = 0.0;
    for (int j = 0; j < 8; ++j) {
      ivec3 o = ivec3(j & 1, (j >> 1) & 1, j >> 2);
      float w = imageLoad(weight_real, 2 * at + o).a;
      p += w * (low + cascade.w * vec3(o));
      n += w * imageLoad(normal_real, 2 * at + o).xyz;
      weight += w;
    }
    if (dot(n, n) < 1e-4 * weight * weight) continue;
    n = normalize(n);
    p /= weight;
    float known = min(weight, 1.0);
    imageStore(irradiance, at, to_half(vec4(lpv_irradiance(p - real_distance(p) * n, n) * known, known)));
  }
}
