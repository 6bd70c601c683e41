#version 460
#extension GL_GOOGLE_include_directive : require
// Area of a virtual object's surface in the voxels in front of it, split like the light on it, so that their ratio is
// the surface's radiosity at any curvature. pass_m: T_tag_model; pass_f.x: factor from m² in the model's frame to
// fixed-point units of voxel faces; pass_i.x: number of samples.
#include "volume/volume.glsl"
#include "volume/splat.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 16) readonly buffer Samples { vec4 samples[]; };  // position, area; normal; emission
layout(std430, binding = 17) buffer Area { int area[]; };

void main() {
  for (uint i = gl_GlobalInvocationID.x; i < uint(frame.pass_i.x); i += gl_NumWorkGroups.x * 64u) {
    vec3 p = (frame.pass_m * vec4(samples[3u * i].xyz, 1.0)).xyz;
    vec3 n = normalize(mat3(frame.pass_m) * samples[3u * i + 1u].xyz);
    float m2 = samples[3u * i].w * frame.pass_f.x;
    // A shell has light on both sides, a solid only in front; surfaces inside another object have none.
    for (int side = -1; side <= 1; side += 2) {
      if (virtual_distance(p + 0.75 * float(side) * frame.virtual_grid.w * n) <= 0.0) continue;
      for (int c = 0; c < kCascades; ++c) {
        Splat s = splat_at(c, p, float(side) * kFront * n);
        if (!s.inside) continue;
        float faces = m2 / (frame.cascade[c].w * frame.cascade[c].w);
        for (int j = 0; j < 8; ++j) {
          uint at = splat_voxel(kVirtual, s, j);
          if (is_kept(at)) atomicAdd(area[at], int(round(faces * splat_weight(s, j))));
        }
      }
    }
  }
}
