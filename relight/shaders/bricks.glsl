// The real distance field as reconstruct published it, on its own grid: bricks of 8³ voxels behind a dense index.
#ifndef BRICKS_GLSL
#define BRICKS_GLSL
#include "frame.glsl"

layout(std430, binding = 20) readonly buffer BrickIndex { int brick_slot[]; };          // -1: no brick
layout(std430, binding = 21) readonly buffer BrickClearance { float brick_clearance_m[]; };  // no surface is nearer
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

// Distance to the nearest brick with a surface, at least.
float field_clearance(vec3 p) {
  int cell = brick_cell(ivec3(floor(p / frame.field.x + 0.5)) >> 3);
  return cell < 0 || frame.bricks_size.w == 0 ? 0.0 : brick_clearance_m[cell];
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

// Trilinear distance; false where any of the 8 voxels around is unknown.
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

// Gradient of the distance by central differences one voxel to either side, one-sided where one side is unknown.
bool field_gradient(vec3 p, float d, out vec3 g) {
  float h = frame.field.x;
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

// Weighted mean over the known voxels around; a: their weight.
vec4 field_radiance(vec3 p) {
  Corners c = corners_of(p);
  vec4 s = vec4(0);
  for (int i = 0; i < 8; ++i) {
    if (c.voxel[i] < 0) continue;
    uvec2 v = brick_radiance[c.voxel[i]];
    vec4 q = vec4(unpackHalf2x16(v.x), unpackHalf2x16(v.y));
    s += c.weight[i] * vec4(q.rgb * q.a, q.a);
  }
  return s.a > 1e-3 ? vec4(s.rgb / s.a, s.a) : vec4(0);
}
vec4 field_albedo(vec3 p) {
  Corners c = corners_of(p);
  vec4 s = vec4(0);
  for (int i = 0; i < 8; ++i) {
    if (c.voxel[i] < 0) continue;
    uvec2 v = brick_albedo[c.voxel[i]];
    vec4 q = vec4(unpackHalf2x16(v.x), unpackHalf2x16(v.y));
    s += c.weight[i] * vec4(q.rgb * q.a, q.a);
  }
  return s.a > 1e-3 ? vec4(s.rgb / s.a, s.a) : vec4(0);
}
#endif
