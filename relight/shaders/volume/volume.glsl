// The volumes that cones march through, and their look-up. Distances are dense, radiance is stored in chunks.
//
// Occlusion is computed from signed distance (real: the fused field; virtual: the objects'), never from filtered
// opacity, so the real and the changed scene have exactly the same occlusion and the error of thesis eq. 5.27 does not
// arise. The colour volumes hold radiance times a surface weight, and that weight; their ratio is the mean radiance of
// the surface inside a footprint, at every level of the hierarchy.
#ifndef VOLUME_GLSL
#define VOLUME_GLSL
#include "volume/chunks.glsl"

// Both cascades are in one texture, stacked along z. Software devices execute both sides of every branch, so one
// look-up at a computed position is half the cost of a branch between two textures.
layout(binding = 1) uniform sampler3D virtual_distance_m;
layout(binding = 2) uniform sampler3D real_distance_m;
layout(binding = 3) uniform sampler3D real_radiance_volume;     // L_mu
layout(binding = 4) uniform sampler3D virtual_radiance_volume;  // L_rho of the virtual objects
layout(binding = 5) uniform sampler3D real_change_volume;       // L_delta of real surfaces, with L_mu's weight
layout(binding = 6) uniform sampler2D environment;  // residual environment of the fish-eye image, equal-area octahedral
layout(binding = 30) uniform sampler2D mirror_outlines;  // of known flat pieces, stacked vertically

layout(std430, binding = 34) readonly buffer GoneCells { uint gone_bits[]; };  // passes/volume/gone_cells.h
layout(binding = 31) uniform sampler2D enclosure_change;  // L_delta of the enclosure, octahedral around its centre

const float kFar = 1e3;

vec3 grid_low(vec4 g) { return g.xyz - 0.5 * g.w; }
vec3 cascade_high(int c) { return grid_low(frame.cascade[c]) + float(frame.grid.x) * frame.cascade[c].w; }
bool in_cascade(int c, vec3 p, float margin_voxels) {
  float m = margin_voxels * frame.cascade[c].w;
  return all(greaterThan(p, grid_low(frame.cascade[c]) + m)) && all(lessThan(p, cascade_high(c) - m));
}
// Weight of the volumes' data on real surfaces: 1 inside, falling to 0 near their border.
float edge_fade(vec3 p) {
  vec3 inside = min(p - grid_low(frame.cascade[1]), cascade_high(1) - p);
  float voxels = min(min(inside.x, inside.y), inside.z) / frame.cascade[1].w - 1.0;
  return clamp(8.0 * voxels / float(frame.grid.x), 0.0, 1.0);
}
// Position of p in voxels from the cascade's corner, clamped to its inside.
vec3 cascade_voxels(int c, vec3 p, float margin_voxels) {
  float n = float(frame.grid.x);
  return clamp((p - grid_low(frame.cascade[c])) / frame.cascade[c].w, vec3(margin_voxels), vec3(n - margin_voxels));
}
// Position of p in the texture of both cascades; `margin_voxels` prevents filtering across the border between them.
vec3 cascade_place(int c, vec3 p, float margin_voxels) {
  float n = float(frame.grid.x);
  return (cascade_voxels(c, p, margin_voxels) + vec3(0.0, 0.0, float(c) * n)) / vec3(n, n, float(kCascades) * n);
}
// Stored value of real surfaces at p.
vec4 real_at(sampler3D pool, int c, vec3 p) { return chunk_linear(pool, kReal, c, cascade_voxels(c, p, 0.5), 0); }

// Signed distance to the virtual objects. Outside the volume a lower bound: the hypotenuse of the distance to the box
// and the distance at its nearest point. A bound that is much too low would occlude light in wide cones.
float virtual_distance(vec3 p) {
  vec3 low = grid_low(frame.virtual_grid), size = vec3(frame.grid.yzw) * frame.virtual_grid.w;
  vec3 centre = low + 0.5 * size, half_size = 0.5 * size - 0.5 * frame.virtual_grid.w;
  float beyond = length(max(abs(p - centre) - half_size, 0.0));
  float d = textureLod(virtual_distance_m, (p - low) / size, 0.0).r;
  return beyond > 0.0 ? sqrt(beyond * beyond + d * d) : d;
}

vec3 virtual_normal(vec3 p) {
  float h = frame.virtual_grid.w;
  vec3 g = vec3(virtual_distance(p + vec3(h, 0, 0)) - virtual_distance(p - vec3(h, 0, 0)),
                virtual_distance(p + vec3(0, h, 0)) - virtual_distance(p - vec3(0, h, 0)),
                virtual_distance(p + vec3(0, 0, h)) - virtual_distance(p - vec3(0, 0, h)));
  return g / max(length(g), 1e-9);
}

// Signed distance to the real surfaces, where known; a lower bound far from them, kFar outside the volumes.
float real_distance(vec3 p) {
  int c = in_cascade(0, p, 0.5) ? 0 : 1;
  float d = textureLod(real_distance_m, cascade_place(c, p, 0.5), 0.0).r;
  return c == 0 || in_cascade(1, p, 0.5) ? d : kFar;
}

// Whether the real surface that is d away from p, or the solid that p is in, is gone.
bool is_gone_at(vec3 p) {
  ivec3 cell = ivec3(floor((p - frame.gone.xyz) / frame.gone.w));
  bool inside = all(greaterThanEqual(cell, ivec3(0))) && all(lessThan(cell, frame.gone_cells.xyz));
  int i = inside ? cell.x + frame.gone_cells.x * (cell.y + frame.gone_cells.y * cell.z) : 0;
  return inside && (gone_bits[i >> 5] >> uint(i & 31) & 1u) != 0u;
}
bool is_gone(vec3 p, float d) {
  float h = 0.5 * frame.cascade[0].w;
  vec3 slope = vec3(real_distance(p + vec3(h, 0, 0)), real_distance(p + vec3(0, h, 0)), real_distance(p + vec3(0, 0, h))) - d;
  return is_gone_at(p - d * slope / max(length(slope), 1e-9)) || (d < 0.0 && is_gone_at(p));
}

// Mean over a footprint of the given radius, times the surface weight; a: the weight.
vec4 footprint(sampler3D pool, int kind, vec3 p, float radius) {
  int c = in_cascade(0, p, max(1.0, 1.5 * radius / frame.cascade[0].w)) ? 0 : 1;
  // Half a level up: trilinear filtering of the level itself would give zero for a footprint that is off the surface.
  float lod = clamp(log2(2.0 * radius / frame.cascade[c].w) + 0.5, 0.0, float(frame.counts2.w - 1));
  vec3 v = cascade_voxels(c, p, 0.5 * exp2(ceil(lod)));
  int level = int(lod);
  float coarser = lod - float(level);
  vec4 s = chunk_linear(pool, kind, c, v, level);
  // A loop that is not entered costs nothing on software devices, unlike a branch.
  for (int i = 0; i < (coarser > 0.0 ? 1 : 0); ++i) s = mix(s, chunk_linear(pool, kind, c, v, level + 1), coarser);
  return s;
}

// Virtual surfaces may be thin walls with a bright and a dark side. Their light is stored in the voxels in front of
// them, not in those that they intersect, so the two sides are kept apart.
const float kFront = 0.75;  // voxels
float front_weight(float d, float voxel) { return max(0.0, 1.0 - abs(d / voxel - kFront)); }

const float kMinWeight = 1e-3;
vec3 mean_radiance(vec4 s) { return s.a < kMinWeight ? vec3(0) : s.rgb / s.a; }
vec3 real_radiance(vec3 p, float radius) { return mean_radiance(footprint(real_radiance_volume, kReal, p, radius)); }
// Viewed along w. Coarse levels mix both sides of an object, the bright and the dark one; `focus` below 1 selects finer
// levels.
vec3 virtual_radiance(vec3 p, vec3 w, float radius, float focus) {
  float voxel = frame.cascade[in_cascade(0, p, 1.0) ? 0 : 1].w, fine = focus * radius;
  vec4 seen = footprint(virtual_radiance_volume, kVirtual, p - kFront * max(voxel, fine) * w, fine);
  // Beyond an object's edge the fine level is empty.
  if (seen.a < kMinWeight) seen = footprint(virtual_radiance_volume, kVirtual, p - kFront * max(voxel, radius) * w, radius);
  return mean_radiance(seen);
}
vec3 real_change(vec3 p, float radius) { return mean_radiance(footprint(real_change_volume, kReal, p, radius)); }

// Equal-area octahedral map of the sphere (Clarberg 2008, "Fast Equal-Area Mapping of the (Hemi)Sphere").
vec2 octahedral(vec3 w) {
  vec3 a = abs(w);
  float r = sqrt(max(1.0 - a.z, 0.0));
  float phi = atan(a.y, max(a.x, 1e-12)) * (2.0 / kPi);
  vec2 uv = vec2(r - phi * r, phi * r);
  if (w.z < 0.0) uv = 1.0 - uv.yx;
  return 0.5 + 0.5 * uv * vec2(w.x < 0.0 ? -1.0 : 1.0, w.y < 0.0 ? -1.0 : 1.0);
}

// Distance at which a ray from inside leaves the enclosure, and the `side` it crosses. kFar if there is no side.
float leave(vec3 p, vec3 w, out int side) {
  float t = kFar;
  side = -1;
  for (int i = 0; i < int(frame.probe.a); ++i) {
    float fall = -dot(frame.sides[i].xyz, w), d = max(dot(frame.sides[i].xyz, p) + frame.sides[i].w, 0.0);
    bool nearer = fall > 1e-4 && d < t * fall;
    t = nearer ? d / fall : t;
    side = nearer ? i : side;
  }
  return t;
}

// Radiance of the environment outside the reconstruction, mean over a cone.
vec3 environment_radiance(vec3 w, float tan_half) {
  // A cone of half angle a covers 2π(1 - cos a); a texel of level 0 covers 4π / size².
  float size = float(textureSize(environment, 0).x);
  float c = inversesqrt(1.0 + tan_half * tan_half);
  float lod = 0.5 * log2(max(0.5 * (1.0 - c), 1e-9) * size * size);
  return textureLod(environment, octahedral(w), clamp(lod, 0.0, float(frame.counts2.y - 1))).rgb;
}

// The same viewed from p, corrected for parallax on a measured side of the enclosure.
vec3 beyond_radiance(vec3 p, vec3 w, float tan_half) {
  int side;
  float t = leave(p, w, side);
  bool measured = side >= 0 && side < int(frame.enclosure.a);
  return environment_radiance(measured ? normalize(p + t * w - frame.probe.xyz) : w, tan_half);
}
// The change of that radiance, by the enclosure only.
vec3 beyond_change(vec3 p, vec3 w) {
  int side;
  float t = leave(p, w, side);
  return side < 0 ? vec3(0) : textureLod(enclosure_change, octahedral(normalize(p + t * w - frame.enclosure.xyz)), 0.0).rgb;
}
#endif
