// Position of the real surface at a pixel, from the depth image and the distance volumes.
#ifndef REAL_DEPTH_GLSL
#define REAL_DEPTH_GLSL
#include "volume/volume.glsl"
layout(binding = 25) uniform sampler2D rays;   // x/z, y/z per pixel
layout(binding = 26) uniform sampler2D depth;  // metres along z, 0: none
#include "screen/real_ray.glsl"

// Normal of a plane through the depth a few pixels to either side, if that is one surface: for points outside the
// volumes.
vec3 depth_normal(ivec2 at) {
  const int kApart_px = 4;
  ivec2 last = frame.picture.xy - 1;
  vec3 p = camera_point(at), a = camera_point(clamp(at - ivec2(kApart_px, 0), ivec2(0), last)),
       b = camera_point(clamp(at + ivec2(kApart_px, 0), ivec2(0), last)),
       c = camera_point(clamp(at - ivec2(0, kApart_px), ivec2(0), last)),
       d = camera_point(clamp(at + ivec2(0, kApart_px), ivec2(0), last));
  vec4 apart = abs(vec4(a.z, b.z, c.z, d.z) - p.z);
  vec3 n = cross(d - c, b - a);
  float l = length(n);
  bool one = max(max(apart.x, apart.y), max(apart.z, apart.w)) < 0.03 * p.z;
  return one && l > 0.0 ? mat3(frame.T_tag_camera) * (n / l) : vec3(0);
}

// The stored normal inside the volumes, that of the depth image elsewhere.
vec3 surface_normal(sampler3D normals, ivec2 at, vec3 p) {
  vec3 n = real_at(normals, in_cascade(0, p, 1.0) ? 0 : 1, p).xyz;
  float l = length(n);
  return in_cascade(1, p, 1.0) && l > 0.5 ? n / l : depth_normal(at);
}

// Whether a measured point is in space that the volumes know as free: it is of what came since, as a hand.
bool came(vec3 p) { return in_cascade(1, p, 1.0) && real_distance(p) > 0.8 * frame.field.y; }

// The surface along the ray where depth has a hole, inside the volumes; in units of |w|, 0: none.
float trace_volume(vec3 eye, vec3 w) {
  float l = length(w), min_step = 0.5 * frame.cascade[0].w;
  vec3 u = w / l;
  vec2 known = ray_box(eye, u, grid_low(frame.cascade[1]), cascade_high(1));
  float t = max(known.x + frame.cascade[1].w, 0.0);  // distances are valid from half a voxel inside
  for (int i = 0; i < 64 && t < known.y; ++i) {
    float d = real_distance(eye + t * u);
    if (d < 0.1 * min_step) return t / l;
    t += max(d, min_step);
  }
  return 0.0;
}
#endif
