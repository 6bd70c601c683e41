// The real surface along a pixel's ray w, per metre of z. For passes that declare `rays` and `depth`.
#include "common/material_mask.glsl"

vec3 camera_point(ivec2 at) {
  vec2 ray = texelFetch(rays, at, 0).xy;
  float z = texelFetch(depth, at, 0).x;
  return vec3(ray * z, z);
}

// The fused surface is less noisy than a single depth image: moves a measured point along the ray onto it. d: distance
// there, which changes by `slope` along w.
void move_to_surface(float d, float slope, vec3 w, inout float z, inout vec3 p) {
  if (!(slope < -0.2 * length(w))) return;
  float dz = clamp(-d / slope, -frame.field.x, frame.field.x);
  z += dz;
  p += dz * w;
}

// The surface of known material seen at a pixel, packed as in material_mask.glsl; 0: none. surface: depth along z and
// number + 1 of the one rendered there.
float known_material(ivec2 at, vec2 surface, vec3 p, float z, vec3 w) {
  if (!(surface.y > 0.0 && abs(surface.x - z) < max(0.01, 0.01 * z))) return 0.0;
  mat3 turn = mat3(frame.T_tag_camera);
  ivec2 last = frame.picture.xy - 1;
  vec2 ray = texelFetch(rays, at, 0).xy, right = texelFetch(rays, min(at + ivec2(1, 0), last), 0).xy - ray,
       down = texelFetch(rays, min(at + ivec2(0, 1), last), 0).xy - ray;
  float paper = paper_in_pixel(p, w, turn * vec3(right, 0.0), turn * vec3(down, 0.0));
  return paper < 1.0 ? pack_known(floor(0.5 * surface.y), paper) : 0.0;
}
