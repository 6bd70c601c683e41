// The real surface in a cell of 2³ voxels.
#ifndef CELL_SURFACE_GLSL
#define CELL_SURFACE_GLSL
#include "volume/volume.glsl"
layout(binding = 25, rgba16f) uniform readonly image3D weight_real;  // L_mu, its a is the surface weight
layout(binding = 26, rgba16f) uniform readonly image3D normal_real;

struct CellSurface {
  vec3 p, n;     // on the surface, tag frame
  float weight;  // amount of surface in the cell, at most 1; 0: unknown normal
};

CellSurface cell_surface(ivec3 at) {
  int m = frame.grid.x / 2;
  vec4 cascade = frame.cascade[at.z / m];
  vec3 low = cascade.xyz + cascade.w * 2.0 * vec3(at.xy, at.z % m), p = vec3(0), n = vec3(0);
  ivec3 first = voxel_texel(kReal, at.z / m, 2 * ivec3(at.xy, at.z % m));
  float weight = 0.0;
  for (int j = 0; j < 8; ++j) {
    ivec3 o = ivec3(j & 1, (j >> 1) & 1, j >> 2);
    float w = imageLoad(weight_real, first + o).a;
    p += w * (low + cascade.w * vec3(o));
    n += w * imageLoad(normal_real, first + o).xyz;
    weight += w;
  }
  if (dot(n, n) < 1e-4 * weight * weight) return CellSurface(vec3(0), vec3(0), 0.0);
  n = normalize(n);
  p /= weight;
  return CellSurface(p - real_distance(p) * n, n, min(weight, 1.0));
}

// Rotation of a cell's sampling pattern: R3 sequence (Roberts 2018).
float cell_turn(ivec3 at) { return fract(dot(vec3(at), vec3(0.8191725, 0.6710436, 0.5497005))); }
#endif
