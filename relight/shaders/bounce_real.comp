#version 460
#extension GL_GOOGLE_include_directive : require
// Change of the irradiance on real surfaces (thesis eq. 3.13, 5.21), gathered from the volumes as they are, once in every
// listed cell. It does not depend on the view, and varies over a cell as little as the voxels that it is gathered from.
#include "gather.glsl"
#include "cells.glsl"
#include "mirror_lamp.glsl"
#include "slice.glsl"
#include "half.glsl"
layout(local_size_x = 64) in;
layout(binding = 18, rgba16f) uniform writeonly image3D irradiance;  // times weight, weight
layout(binding = 25, rgba16f) uniform readonly image3D weight_real;  // L_mu, its a is the surface weight
layout(binding = 26, rgba16f) uniform readonly image3D normal_real;

// Rotation of a cell's sampling pattern: R3 sequence (Roberts 2018).
float cell_turn(ivec3 at) { return fract(dot(vec3(at), vec3(0.8191725, 0.6710436, 0.5497005))); }

void main() {
  int m = frame.grid.x / 2;
  for (uint i = slice_first(); i < cells_listed(); i += slice_stride()) {
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
    vec3 on = p - real_distance(p) * n, off = on + max(frame.cascade[0].w, 0.75 * frame.field.x) * n;
    vec3 gained, lost;
    gather_delta(on, off, n, frame.counts.y, cell_turn(at), gained, lost);
    vec3 e = gained - lost + gather_change(off, on, n, frame.pass_i.x, cell_turn(at));
    // What lamps no longer bring by way of mirrors, as long as it is other surfaces that want to know.
    Cone k;
    k.from_virtual = on;
    k.from_real = off;
    e -= mirrored_lost(on, n, k, frame.pass_i.y, cell_turn(at));
    float known = min(weight, 1.0);
    imageStore(irradiance, at, to_half(vec4(e * known, known)));
  }
}
