// The real surface at a pixel and the change of its light, for the live setting, where all inputs of the change were
// gathered once for the room. A Lambert surface reflects its irradiance times ρ/π; `response` is ρ/π over the radiance
// measured there, so the camera image times 1 + response · change is the changed image, including its detail.
#ifndef LIVE_REAL_GLSL
#define LIVE_REAL_GLSL
#include "screen/real_depth.glsl"
#include "screen/emission_beyond.glsl"
#include "common/influence_mask.glsl"
#include "common/unoccluded_irradiance.glsl"
layout(binding = 27) uniform sampler2D codes;    // of the camera, 8-bit sRGB
layout(binding = 20) uniform sampler3D real_response;    // times weight, weight
layout(binding = 21) uniform sampler3D real_normal;      // and distance
layout(binding = 22) uniform sampler3D real_irradiance;  // its change, times weight, weight

vec3 normal_at(ivec2 at, vec3 p) { return surface_normal(real_normal, at, p); }
vec3 coded(ivec2 at) { return texelFetch(codes, at, 0).rgb; }
#include "screen/hole_fill.glsl"

struct LivePlace {
  vec3 p, n;    // tag frame; n 0: unknown
  float z;      // in the camera frame, 0: unknown
  int cascade;
  bool inside;  // inside the volumes
  bool came;    // since these were filled
};

LivePlace live_place(ivec2 at) {
  vec3 eye = frame.T_tag_camera[3].xyz;
  vec3 w = mat3(frame.T_tag_camera) * vec3(texelFetch(rays, at, 0).xy, 1.0);  // per metre of z
  float z = texelFetch(depth, at, 0).x;
  bool measured = z > 0.0;
  if (!measured) z = trace_volume(eye, w);
  vec3 p = eye + z * w;
  int c = in_cascade(0, p, 1.0) ? 0 : 1;
  bool inside = z > 0.0 && in_cascade(1, p, 1.0);
  vec4 surface = real_at(real_normal, c, p);
  float l = length(surface.xyz);
  vec3 n = surface.xyz / max(l, 1e-6);
  if (inside && l > 0.5) {
    if (measured) move_to_surface(surface.a, dot(n, w), w, z, p);
  } else {
    n = z > 0.0 && measured ? depth_normal(at) : vec3(0);
  }
  return LivePlace(p, n, z, c, inside, measured && l <= 0.5 && came(p));
}

struct LiveReal {
  vec3 p, n;      // tag frame; n 0: unknown
  float slack;    // uncertainty of its position, m
  bool came;      // since the volumes were filled
  vec3 response;  // 0: unknown
  vec3 indirect;  // change of irradiance, fading out at the edge of the influence mask
};

LiveReal live_real(ivec2 at, vec3 code) {
  LivePlace q = live_place(at);
  vec4 k = real_at(real_response, q.cascade, q.p);
  vec3 like = q.p;  // where known colour and change of light are looked up
  bool measured = texelFetch(depth, at, 0).x > 0.0;
  Plane plane = similar_plane(at, !measured || q.n == vec3(0) || q.inside && !q.came && k.a <= 1e-3);
  // Distances next to unknown space are unreliable: a surface traced behind the plane is moved to the plane.
  vec3 w = mat3(frame.T_tag_camera) * vec3(texelFetch(rays, at, 0).xy, 1.0);
  float there = measured ? 0.0 : on_plane(plane, w);
  bool guessed = there > 0.0 && (q.z == 0.0 || q.n == vec3(0) || there < q.z);
  if (plane.z > 0.0 && (guessed || measured && q.n == vec3(0) || q.z > 0.0 && k.a <= 1e-3)) {
    if (guessed) q.p = frame.T_tag_camera[3].xyz + there * w;
    if (guessed || q.n == vec3(0)) q.n = plane.n;
    like = plane.p;
    q.cascade = in_cascade(0, like, 1.0) ? 0 : 1;
    k = real_at(real_response, q.cascade, like);
  }
  vec4 e = textureLod(real_irradiance, cascade_place(q.cascade, like, 1.0), 0.0);
  // Outside the volumes, and of what came, the response is estimated from the light as 1 / E, blended to the known value
  // inside.
  float within = q.came ? 0.0 : edge_fade(q.p);
  vec3 response = k.a > 1e-3 ? within / k.a * k.rgb : vec3(0);
  if (within < 1.0) response += (1.0 - within) / max(open_irradiance(q.p, q.n), vec3(1e-6));
  float root = (max(max(code.x, code.y), code.z) + 0.055) / 1.055;
  float footprint = indirect_footprint_of(q.p, q.n, root, false);
  return LiveReal(q.p, q.n, 2.0 * frame.cascade[q.cascade].w, q.came, dot(q.n, q.n) > 0.0 ? response : vec3(0),
                  footprint * with_emission_beyond(e.a > 1e-3 ? e.rgb / e.a : vec3(0), q.p, q.n));
}

// Factor of the radiance.
vec3 bounded_gain(vec3 gain) { return any(isnan(gain)) || any(isinf(gain)) ? vec3(1) : max(gain, vec3(0)); }
#endif
