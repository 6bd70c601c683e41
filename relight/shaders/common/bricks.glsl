// The real distance field as published by reconstruct, on its own grid: bricks of 8³ voxels behind a dense index.
#ifndef BRICKS_GLSL
#define BRICKS_GLSL
#include "common/frame.glsl"

layout(std430, binding = 20) readonly buffer BrickIndex { int brick_slot[]; };          // -1: no brick
layout(std430, binding = 21) readonly buffer BrickClearance { uint clearance[]; };  // half2: metres, by half brick
layout(std430, binding = 22) readonly buffer BrickDistance { uint brick_distance[]; };  // half2: metres, known
layout(std430, binding = 23) readonly buffer BrickRadiance { uvec2 brick_radiance[]; }; // half4: rgb, known
layout(std430, binding = 24) readonly buffer BrickAlbedo { uvec2 brick_albedo[]; };     // half4: rgb, known

int brick_cell(ivec3 brick) {
  brick -= frame.bricks_low.xyz;
  if (any(lessThan(brick, ivec3(0))) || any(greaterThanEqual(brick, frame.bricks_size.xyz))) return -1;
  return brick.x + frame.bricks_size.x * (brick.y + frame.bricks_size.y * brick.z);
}

int voxel_of(ivec3 voxel) {
  ivec3 brick = voxel >> 3;
  int cell = brick_cell(brick);
  if (cell < 0 || frame.bricks_size.w == 0) return -1;
  int slot = brick_slot[cell];
  ivec3 at = voxel & 7;
  return slot < 0 ? -1 : slot * 512 + at.x + 8 * (at.y + 8 * at.z);
}

// Whether the field has a voxel nearest to p.
bool held(vec3 p) { return voxel_of(ivec3(floor(p / frame.field.x + 0.5))) >= 0; }

// Distance from the centre of a cell of half a brick's edge to the nearest surface, for cells inside the index.
const int kHalfBrick = kBrickCells / 2;
float cell_clearance(ivec3 cell) {
  ivec3 size = 2 * frame.bricks_size.xyz;
  cell = clamp(cell - 2 * frame.bricks_low.xyz, ivec3(0), size - 1);
  int at = cell.x + size.x * (cell.y + size.y * cell.z);
  return unpackHalf2x16(clearance[at >> 1])[at & 1];
}
bool in_index(vec3 p) {
  return brick_cell(ivec3(floor(p / frame.field.x + 0.5)) >> 3) >= 0 && frame.bricks_size.w != 0;
}

// Lower bound of the distance to the surface: the cell's distance minus three half diagonals of a cell, for the
// position of p in its cell, of the surface in its cell, and of the surface's own point.
float field_clearance(vec3 p) {
  if (!in_index(p)) return 0.0;
  float d = cell_clearance(ivec3(floor(p / frame.field.x + 0.5)) >> 2);
  return max(d - 1.5 * sqrt(3.0) * float(kHalfBrick) * frame.field.x, 0.0);
}

// Approximate distance to the nearest surface, interpolated between the cells' centres. Outside the index: the
// hypotenuse of the distance to the index box and the distance at the nearest point of the box.
float far_distance(vec3 p) {
  if (frame.bricks_size.w == 0) return 0.0;
  vec3 low = (vec3(frame.bricks_low.xyz * kBrickCells) - 0.5) * frame.field.x;
  vec3 q = clamp(p, low, low + vec3(frame.bricks_size.xyz * kBrickCells) * frame.field.x);
  vec3 g = (q / frame.field.x + 0.5) / float(kHalfBrick) - 0.5;
  ivec3 base = ivec3(floor(g));
  vec3 f = g - vec3(base);
  float d = 0.0;
  for (int i = 0; i < 8; ++i) {
    ivec3 o = ivec3(i & 1, (i >> 1) & 1, i >> 2);
    vec3 w = mix(1.0 - f, f, vec3(o));
    d += w.x * w.y * w.z * cell_clearance(base + o);
  }
  return q == p ? d : length(vec2(d, distance(p, q)));
}

struct Corners {
  int voxel[8];
  float weight[8];
};
Corners corners_of(vec3 p) {
  vec3 g = p / frame.field.x;
  ivec3 base = ivec3(floor(g));
  vec3 f = g - vec3(base);
  Corners c;
  for (int i = 0; i < 8; ++i) {
    ivec3 o = ivec3(i & 1, (i >> 1) & 1, i >> 2);
    vec3 w = mix(1.0 - f, f, vec3(o));
    c.voxel[i] = voxel_of(base + o);
    c.weight[i] = w.x * w.y * w.z;
  }
  return c;
}

// Trilinear distance; false if any of the 8 surrounding voxels is unknown.
bool field_distance(vec3 p, out float d) {
  Corners c = corners_of(p);
  d = 0.0;
  for (int i = 0; i < 8; ++i) {
    if (c.voxel[i] < 0) return false;
    vec2 v = unpackHalf2x16(brick_distance[c.voxel[i]]);
    if (v.y == 0.0) return false;
    d += c.weight[i] * v.x;
  }
  return true;
}

// Central differences of the distance with step `h` (metres), one-sided where one side is unknown.
bool field_slope(vec3 p, float d, float h, out vec3 g) {
  for (int a = 0; a < 3; ++a) {
    vec3 e = vec3(0);
    e[a] = h;
    float up, down;
    bool has_up = field_distance(p + e, up), has_down = field_distance(p - e, down);
    if (has_up && has_down) g[a] = (up - down) / (2.0 * h);
    else if (has_up) g[a] = (up - d) / h;
    else if (has_down) g[a] = (d - down) / h;
    else return false;
  }
  return dot(g, g) > 1e-4;
}

// Gradient of the distance with a step of two voxels, which halves the noise of depth, where the surface is flat at
// that scale: there the gradient's length is 1, and less across an edge.
bool field_gradient(vec3 p, float d, out vec3 g) {
  if (!field_slope(p, d, frame.field.x, g)) return false;
  vec3 wide;
  if (field_slope(p, d, 2.0 * frame.field.x, wide)) g = mix(g, wide, smoothstep(0.9, 0.97, length(wide)));
  return true;
}

vec4 weighted(float weight, uvec2 half4) {
  vec4 q = vec4(unpackHalf2x16(half4.x), unpackHalf2x16(half4.y));
  return weight * vec4(q.rgb * q.a, q.a);
}
vec4 mean_of(vec4 sum) { return sum.a > 1e-3 ? vec4(sum.rgb / sum.a, sum.a) : vec4(0); }

// Weighted mean over the surrounding known voxels; a: their weight.
vec4 field_radiance(vec3 p) {
  Corners c = corners_of(p);
  vec4 sum = vec4(0);
  for (int i = 0; i < 8; ++i) {
    if (c.voxel[i] >= 0) sum += weighted(c.weight[i], brick_radiance[c.voxel[i]]);
  }
  return mean_of(sum);
}
vec4 field_albedo(vec3 p) {
  Corners c = corners_of(p);
  vec4 sum = vec4(0);
  for (int i = 0; i < 8; ++i) {
    if (c.voxel[i] >= 0) sum += weighted(c.weight[i], brick_albedo[c.voxel[i]]);
  }
  return mean_of(sum);
}
#endif
