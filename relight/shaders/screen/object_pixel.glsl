// The virtual surface at a pixel, as used by the shading passes.
#ifndef OBJECT_PIXEL_GLSL
#define OBJECT_PIXEL_GLSL
#include "volume/gather.glsl"
#include "common/brdf.glsl"
layout(binding = 12) uniform sampler2D object_normal;
layout(binding = 13) uniform sampler2D object_base;
layout(binding = 14) uniform sampler2D object_surface;
layout(binding = 15) uniform sampler2D rays;

struct ObjectPixel {
  vec3 p, n, v;  // position, normal, unit vector to the camera; tag frame
  float metallic;
  BsdfParams bsdf;
  bool mirror;
  vec3 from_real, from_virtual;  // origins of cones
};

ObjectPixel object_pixel(ivec2 at) {
  vec4 surface = texelFetch(object_surface, at, 0), normal = texelFetch(object_normal, at, 0),
       base = texelFetch(object_base, at, 0);
  vec3 eye = frame.T_tag_camera[3].xyz;
  ObjectPixel o;
  o.p = eye + mat3(frame.T_tag_camera) * (surface.x * vec3(texelFetch(rays, at, 0).xy, 1.0));
  o.v = normalize(eye - o.p);
  o.n = normalize(normal.xyz);
  bool gltf = base.a > 1.5;
  o.metallic = clamp(gltf ? base.a - 2.0 : base.a, 0.0, 1.0);
  o.bsdf = bsdf_of(base.rgb, normal.a, o.metallic, surface.z);
  o.bsdf.gltf = gltf;
  o.mirror = o.bsdf.f90 + o.metallic > 0.0;
  o.from_real = o.p + 0.25 * frame.field.x * o.n;
  o.from_virtual = o.p + frame.virtual_grid.w * o.n;
  return o;
}

// Radiance of the specular part, by cones along its lobe.
vec3 mirrored(ObjectPixel o, float turn) {
  int count = frame.counts2.x;
  Cone k;
  k.from_real = o.from_real;
  k.from_virtual = o.from_virtual;
  k.tan_half = clamp(0.7 * o.bsdf.alpha / sqrt(float(count)), 0.01, 0.5);
  vec3 sum = vec3(0);
  for (int i = 0; i < count; ++i) {
    vec3 weight;
    k.w = ggx_sample(o.bsdf, o.n, o.v, vec2(fract(float(i) * 0.61803399 + turn), (float(i) + 0.5) / float(count)), weight);
    if (dot(weight, weight) > 0.0) sum += weight * rho_cone(k);
  }
  return sum / float(count);
}

// Lobes of at least this width are traced at the resolution of the ambient light; sharper ones per pixel.
const float kBroadLobe = 0.1;  // GGX alpha
#endif
