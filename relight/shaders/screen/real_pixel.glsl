// The real surface at a pixel from the light volumes, with the change of irradiance gathered in their cells: one
// look-up each, where the bricks (real_view_bricks.comp) need dozens. Less detailed where the outer cascade is coarser
// than the field. pass_f.x: min_code_change of the influence mask.
#ifndef REAL_PIXEL_GLSL
#define REAL_PIXEL_GLSL
#include "screen/real_depth.glsl"
#include "screen/emission_beyond.glsl"
#include "common/influence_mask.glsl"
#include "common/unoccluded_irradiance.glsl"
#include "screen/clipped.glsl"
layout(binding = 27) uniform sampler2D radiance; // the camera image, linear
layout(binding = 28) uniform sampler2D surfaces; // depth along z and number + 1 of surfaces of known material
layout(binding = 7) uniform sampler3D real_albedo_volume;
layout(binding = 8) uniform sampler3D real_normal_volume;
layout(binding = 9) uniform sampler3D real_irradiance;  // times weight, weight

vec3 normal_at(ivec2 at, vec3 p) { return surface_normal(real_normal_volume, at, p); }
vec3 coded(ivec2 at) { return pow(frame.exposure.rgb * texelFetch(radiance, at, 0).rgb, vec3(1.0 / 2.4)); }
#include "screen/hole_fill.glsl"

struct RealPixel {
  vec3 p, n;        // tag frame; n 0: unknown
  float z;          // in the camera frame, < 0: estimated, 0: unknown
  float footprint;  // influence mask, 0 to 1
  vec4 albedo;      // a: number + 1 of a surface of known material, 0: solved, -1: unknown
  vec3 indirect;    // change of irradiance
};

RealPixel real_pixel(ivec2 at) {
  vec3 eye = frame.T_tag_camera[3].xyz;
  vec3 w = mat3(frame.T_tag_camera) * vec3(texelFetch(rays, at, 0).xy, 1.0);  // per metre of z
  float z = texelFetch(depth, at, 0).x;
  bool measured = z > 0.0;
  if (!measured) z = trace_volume(eye, w);
  vec3 p = eye + z * w, n = vec3(0), b = texelFetch(radiance, at, 0).rgb;
  vec4 albedo = vec4(0);
  float footprint = 0.0;
  vec3 indirect = vec3(0);
  int c = in_cascade(0, p, 1.0) ? 0 : 1;
  bool inside = in_cascade(1, p, 1.0), new = false;
  if (z > 0.0) {
    n = real_at(real_normal_volume, c, p).xyz;
    float l = length(n);
    if (inside && l > 0.5) {
      n /= l;
      float d = textureLod(real_distance_m, cascade_place(c, p, 0.5), 0.0).r;
      if (measured) move_to_surface(d, dot(n, w), w, z, p);
    } else {
      n = measured ? depth_normal(at) : vec3(0);
      new = measured && came(p);
    }
    albedo = real_at(real_albedo_volume, c, p);
  }
  vec3 like = p;  // where known colour and change of light are looked up
  Plane plane = similar_plane(at, !measured || n == vec3(0) || inside && !new && albedo.a <= 1e-3);
  // Distances next to unknown space are unreliable: a surface traced behind the plane is moved to the plane.
  float there = measured ? 0.0 : on_plane(plane, w);
  bool guessed = there > 0.0 && (z == 0.0 || n == vec3(0) || there < z);
  if (plane.z > 0.0 && (guessed || n == vec3(0) || albedo.a <= 1e-3)) {
    z = guessed ? there : z;
    p = eye + z * w;
    n = guessed || n == vec3(0) ? plane.n : n;
    like = plane.p;
    c = in_cascade(0, like, 1.0) ? 0 : 1;
    inside = in_cascade(1, like, 1.0);
    albedo = real_at(real_albedo_volume, c, like);
  }
  if (z > 0.0) {
    float known = known_material(at, texelFetch(surfaces, at, 0).xy, p, z, w);
    // Blocks that no shadow can reach were not dispatched to the shadow pass, so no test is needed here.
    if (dot(n, n) > 0.0) footprint = max(indirect_footprint(p, n, b, known > 0.0), kShadowOnly);
    vec4 mean = real_at(real_radiance_volume, c, like);
    if (inside && albedo.a > 1e-3 && mean.a > 1e-3) {
      // Voxels are coarser than pixels: the image's detail modulates the fused mean.
      albedo.rgb = min(albedo.rgb / albedo.a * image_detail(b, mean.rgb / mean.a), vec3(1));
    } else {
      albedo = vec4(0);
    }
    // Outside the volumes, and of what came, estimated from the light.
    float within = new ? 0.0 : edge_fade(p);
    if (within < 1.0 && dot(n, n) > 0.0) {
      albedo = vec4(mix(albedo_by_light(p, n, b), albedo.rgb, albedo.a > 0.0 ? within : 0.0), 1.0);
    }
    vec4 e = textureLod(real_irradiance, cascade_place(c, like, 1.0), 0.0);
    if (inside && e.a > 1e-3) indirect = e.rgb / e.a;
    indirect = with_emission_beyond(indirect, p, n);
    albedo.a = known > 0.0 ? known : (albedo.a > 0.0 ? 0.0 : -1.0);
  }
  return RealPixel(p, n, guessed ? -z : z, footprint, albedo, indirect);
}
#endif
