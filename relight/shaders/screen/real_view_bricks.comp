#version 460
#extension GL_GOOGLE_include_directive : require
// The real surface at every pixel: position, normal, colour, and whether the objects can change its light.
#include "common/bricks.glsl"
#include "common/influence_mask.glsl"
#include "common/unoccluded_irradiance.glsl"
#include "screen/clipped.glsl"
#include "common/half.glsl"
#include "common/tiles.glsl"
layout(binding = 1) uniform sampler2D rays;     // x/z, y/z per pixel
layout(binding = 2) uniform sampler2D depth;    // metres along z, 0: none
layout(binding = 3) uniform sampler2D radiance; // the camera image, linear
layout(binding = 4) uniform sampler2D surfaces; // depth along z and number + 1 of surfaces of known material
layout(binding = 12, rgba32f) uniform writeonly image2D out_position;  // a: camera z, < 0: estimated, 0: unknown
layout(binding = 13, rgba16f) uniform writeonly image2D out_normal;    // a: influence mask, 0 to 1
layout(binding = 14, rgba16f) uniform writeonly image2D out_albedo;    // a: number + 1 of a surface of known material
#include "screen/real_ray.glsl"

// Normal of a plane through the depth around a pixel, using neighbours within 3 % of its depth.
vec3 depth_normal(ivec2 at) {
  vec3 p = camera_point(at), dx = vec3(0), dy = vec3(0);
  for (int j = -2; j <= 2; ++j) {
    for (int i = 1; i <= 2; ++i) {
      ivec2 x0 = at + ivec2(-i, j), x1 = at + ivec2(i, j), y0 = at + ivec2(j, -i), y1 = at + ivec2(j, i);
      ivec2 low = min(min(x0, x1), min(y0, y1)), high = max(max(x0, x1), max(y0, y1));
      if (any(lessThan(low, ivec2(0))) || any(greaterThanEqual(high, frame.picture.xy))) continue;
      vec3 a = camera_point(x0), b = camera_point(x1), c = camera_point(y0), d = camera_point(y1);
      float tolerance = 0.03 * p.z;
      if (abs(a.z - p.z) < tolerance && abs(b.z - p.z) < tolerance) dx += b - a;
      if (abs(c.z - p.z) < tolerance && abs(d.z - p.z) < tolerance) dy += d - c;
    }
  }
  vec3 n = cross(dy, dx);
  float l = length(n);
  return l > 0.0 ? mat3(frame.T_tag_camera) * (n / l) : vec3(0);
}

vec3 normal_at(ivec2 at, vec3 p) {
  float d;
  vec3 g;
  return field_distance(p, d) && field_gradient(p, d, g) ? normalize(g) : depth_normal(at);
}
vec3 coded(ivec2 at) { return pow(frame.exposure.rgb * texelFetch(radiance, at, 0).rgb, vec3(1.0 / 2.4)); }
#include "screen/hole_fill.glsl"

// The field's surface along the ray where depth has a hole.
float trace_field(vec3 eye, vec3 w, float far) {
  float t = 0.2, before = 0.0;
  for (int i = 0; i < 128 && t < far; ++i) {
    float d;
    vec3 p = eye + t * w;
    if (!field_distance(p, d)) d = max(field_clearance(p), 0.5 * frame.field.x) ;
    else if (d <= 0.0) return before > 0.0 ? t : 0.0;
    before = d;
    t += max(d, 0.25 * frame.field.x);
  }
  return 0.0;
}

void main() {
  ivec2 at = tile_texel();
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  vec3 eye = frame.T_tag_camera[3].xyz;
  vec3 w = mat3(frame.T_tag_camera) * vec3(texelFetch(rays, at, 0).xy, 1.0);  // per metre of z
  float z = texelFetch(depth, at, 0).x;
  bool measured = z > 0.0;
  if (!measured) z = trace_field(eye, normalize(w), 4.0) / length(w);
  vec3 p = eye + z * w, n = vec3(0), b = texelFetch(radiance, at, 0).rgb;
  vec4 albedo = vec4(0);
  float footprint = 0.0;
  vec2 surface = texelFetch(surfaces, at, 0).xy;
  // Upper bound over all surface normals: pixels below the threshold need no surface at all. On glossy surfaces of
  // known material the bound is higher.
  bool within = z > 0.0 && in_footprint(p, normalize(frame.sphere.xyz - p), b, surface.y > 0.0) > 0.0;
  if (within) {
    float d;
    vec3 g;
    bool fused = field_distance(p, d) && abs(d) < 0.8 * frame.field.y && field_gradient(p, d, g);
    if (fused) {
      n = normalize(g);
      if (measured) move_to_surface(d, dot(g, w), w, z, p);
    } else if (measured) {
      n = depth_normal(at);
    }
    albedo = field_albedo(p);
  }
  vec3 like = p;  // where known colour is looked up
  bool guessed = !measured && (z == 0.0 || within && n == vec3(0));
  Plane plane = similar_plane(at, guessed || within && (n == vec3(0) || albedo.a == 0.0 && held(p)));
  if (plane.z > 0.0) {
    if (guessed) {
      z = on_plane(plane, w);
      p = eye + z * w;
      within = z > 0.0 && in_footprint(p, plane.n, b, surface.y > 0.0) > 0.0;
    }
    if (n == vec3(0)) n = plane.n;
    like = plane.p;
    albedo = field_albedo(like);
  }
  if (within) {
    float known = known_material(at, surface, p, z, w);
    if (dot(n, n) > 0.0) footprint = in_footprint(p, n, b, known > 0.0);
    if (footprint > 0.0) {
      vec4 mean = field_radiance(like);
      if (albedo.a > 0.0 && mean.a > 0.0) {
        // Voxels are coarser than pixels: the image's detail modulates the fused mean.
        albedo.rgb = min(albedo.rgb * image_detail(b, mean.rgb), vec3(1));
      } else if (!held(like)) {  // shadows extend beyond the part of the field that is stored
        albedo = vec4(albedo_by_light(p, n, b), 1.0);
      }
    }
    albedo.a = known > 0.0 ? known : (albedo.a > 0.0 ? 0.0 : -1.0);
  }
  imageStore(out_position, at, vec4(p, guessed ? -z : z));  // an estimated surface occludes no object
  imageStore(out_normal, at, to_half(vec4(n, footprint)));
  imageStore(out_albedo, at, to_half(albedo));
}
