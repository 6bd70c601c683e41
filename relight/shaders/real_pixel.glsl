// The real surface that a pixel shows, from the light volumes, with the change of irradiance that their cells gathered:
// one look-up each where the bricks (real_view_bricks.comp) take dozens. Coarser where the outer cascade is coarser than
// the field. pass_f.x: least_codes of the footprint.
#ifndef REAL_PIXEL_GLSL
#define REAL_PIXEL_GLSL
#include "volume.glsl"
#include "footprint.glsl"
layout(binding = 25) uniform sampler2D rays;     // x/z, y/z of every pixel
layout(binding = 26) uniform sampler2D depth;    // metres along z, 0: none
layout(binding = 27) uniform sampler2D radiance; // the camera picture, linear
layout(binding = 28) uniform sampler2D surfaces; // depth along z and number + 1 of known surfaces
layout(binding = 7) uniform sampler3D real_albedo_volume;
layout(binding = 8) uniform sampler3D real_normal_volume;
layout(binding = 9) uniform sampler3D real_irradiance;  // times weight, weight

vec3 camera_point(ivec2 at) {
  vec2 ray = texelFetch(rays, at, 0).xy;
  float z = texelFetch(depth, at, 0).x;
  return vec3(ray * z, z);
}

// Plane through the depth a few pixels to either side, where that is one surface: for what the volumes don't reach.
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

// The surface along the ray where depth has a hole, inside the volumes; in units of |w|, 0: none.
float trace_volume(vec3 eye, vec3 w) {
  float l = length(w), least = 0.5 * frame.cascade[0].w;
  vec3 u = w / l;
  vec2 known = ray_box(eye, u, grid_low(frame.cascade[1]), cascade_high(1));
  float t = max(known.x, 0.0);
  for (int i = 0; i < 64 && t < known.y; ++i) {
    float d = real_distance(eye + t * u);
    if (d < 0.1 * least) return t / l;
    t += max(d, least);
  }
  return 0.0;
}

struct RealPixel {
  vec3 p, n;        // tag frame; n 0: unknown
  float z;          // in the camera, 0: unknown
  float footprint;  // up to 1: how far inside the delta's
  vec4 albedo;      // a: number + 1 of a known surface, 0: solved, -1: unknown
  vec3 indirect;    // change of irradiance
};

RealPixel real_pixel(ivec2 at) {
  vec3 ray = vec3(texelFetch(rays, at, 0).xy, 1.0), eye = frame.T_tag_camera[3].xyz;
  vec3 w = mat3(frame.T_tag_camera) * ray;  // per metre of z
  float z = texelFetch(depth, at, 0).x;
  bool measured = z > 0.0;
  if (!measured) z = trace_volume(eye, w);
  vec3 p = eye + z * w, n = vec3(0), b = texelFetch(radiance, at, 0).rgb;
  vec4 albedo = vec4(0);
  float footprint = 0.0;
  vec3 indirect = vec3(0);
  if (z > 0.0) {
    int c = in_cascade(0, p, 1.0) ? 0 : 1;
    bool inside = in_cascade(1, p, 1.0);
    n = textureLod(real_normal_volume, cascade_place(c, p, 0.5), 0.0).xyz;
    float l = length(n);
    if (inside && l > 0.5) {
      n /= l;
      // The fused surface is less noisy than one picture's depth: move along the ray on to it.
      float d = textureLod(real_distance_m, cascade_place(c, p, 0.5), 0.0).r, slope = dot(n, w);
      if (measured && slope < -0.2 * length(w)) {
        float dz = clamp(-d / slope, -frame.field.x, frame.field.x);
        z += dz;
        p += dz * w;
      }
    } else {
      n = measured ? depth_normal(at) : vec3(0);
    }
    vec2 surface = texelFetch(surfaces, at, 0).xy;
    float known = 0.0;
    bool on_tag = all(lessThan(abs(p.xyz), vec3(frame.tag.xx, 0.01)));  // paper, whatever it lies on
    if (surface.y > 0.0 && !on_tag && abs(surface.x - z) < max(0.01, 0.01 * z)) known = floor(0.5 * surface.y);
    // Blocks that no shadow can reach were not dispatched to the shadow pass: no need to ask again here.
    if (dot(n, n) > 0.0) footprint = max(indirect_footprint(p, n, b, known > 0.0), kShadowOnly);
    vec3 place = cascade_place(c, p, 0.5);
    albedo = textureLod(real_albedo_volume, place, 0.0);
    vec4 mean = textureLod(real_radiance_volume, place, 0.0);
    if (inside && albedo.a > 1e-3 && mean.a > 1e-3) {
      // Voxels are coarser than pixels: the picture's own detail rides on the fused mean.
      vec3 detail = clamp(b / max(mean.rgb / mean.a, vec3(1e-5)), vec3(0.2), vec3(4.0));
      albedo.rgb = min(albedo.rgb / albedo.a * detail, vec3(1));
    } else {
      albedo = vec4(0);
    }
    vec4 e = textureLod(real_irradiance, cascade_place(c, p, 1.0), 0.0);
    if (inside && e.a > 1e-3) indirect = e.rgb / e.a;
    albedo.a = known > 0.0 ? known : (albedo.a > 0.0 ? 0.0 : -1.0);
  }
  return RealPixel(p, n, z, footprint, albedo, indirect);
}
#endif
