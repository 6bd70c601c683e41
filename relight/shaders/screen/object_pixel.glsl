// The virtual surface at a pixel, as used by the shading passes.
#ifndef OBJECT_PIXEL_GLSL
#define OBJECT_PIXEL_GLSL
#include "volume/gather.glsl"
#include "common/brdf.glsl"
#include "common/clearcoat.glsl"
layout(binding = 12) uniform sampler2D object_normal;
layout(binding = 13) uniform sampler2D object_base;
layout(binding = 14) uniform sampler2D object_surface;
layout(binding = 15) uniform sampler2D rays;

struct ObjectPixel {
  vec3 p, n, v;  // position, normal, unit vector to the camera; tag frame
  float metallic;
  float transmission;  // fraction of the light under the layer that passes the surface
  vec3 passes;         // its colour, without the layer's share
  int glass;    // number of its Glass + 1; 0: opaque
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
  o.glass = int(base.a / 4.0);
  base.a -= 4.0 * float(o.glass);
  bool gltf = base.a > 1.5;
  o.metallic = clamp(gltf ? base.a - 2.0 : base.a, 0.0, 1.0);
  o.bsdf = bsdf_of(base.rgb, normal.a, o.metallic, surface.z);
  o.bsdf.gltf = gltf;
  o.transmission = 0.0;
  o.passes = vec3(0);
  if (o.glass > 0) {
    float ior = frame.glass[o.glass - 1].ior_refracts.x;
    float root = (ior - 1.0) / (ior + 1.0);
    o.bsdf.f0 = mix(vec3(surface.z * root * root), base.rgb, o.metallic);
  }
  o.mirror = o.bsdf.f90 + o.metallic > 0.0;
  o.from_real = o.p + 0.25 * frame.field.x * o.n;
  o.from_virtual = o.p + frame.virtual_grid.w * o.n;
  return o;
}

void transmit(inout ObjectPixel o, float fraction) {
  o.transmission = fraction;
  o.passes = fraction * o.bsdf.diffuse;
  o.bsdf.diffuse *= 1.0 - fraction;
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

// Radiance that passes a transmissive surface: by a cone that is refracted where it enters and, where the distance
// field ends, where it leaves. Reflection within the object is left out: what it takes from this cone others bring.
vec3 passed(ObjectPixel o) {
  Glass glass = frame.glass[o.glass - 1];
  bool refracts = glass.ior_refracts.y > 0.0;
  float ior = glass.ior_refracts.x, voxel = frame.virtual_grid.w;
  vec3 w = refracts ? refract(-o.v, o.n, 1.0 / ior) : -o.v, weight = o.passes * (1.0 - fresnel(o.bsdf, dot(o.n, o.v)));
  float t = 1.5 * voxel;
  for (int i = 0; i < kMaxSteps; ++i) {
    float d = virtual_distance(o.p + t * w);
    if (d > 0.0) break;
    t += max(-0.75 * d, 0.25 * voxel);
  }
  vec3 out_at = o.p + t * w, n = virtual_normal(out_at);
  if (refracts) {
    // The second surface colours, too.
    weight *= exp(-glass.absorption.rgb * t) * o.passes / max(o.transmission, 1e-3);
    vec3 out_w = refract(w, dot(w, n) > 0.0 ? -n : n, ior);
    w = out_w == vec3(0) ? -o.v : out_w;  // total reflection: where it leaves at last is not followed
  }
  Cone k;
  k.w = w;
  k.from_virtual = out_at + voxel * n;
  k.from_real = out_at + 0.25 * frame.field.x * n;
  k.tan_half = clamp(0.7 * o.bsdf.alpha, 0.01, 0.5);
  return weight * rho_cone(k);
}

// Lobes of at least this width are traced at the resolution of the ambient light; sharper ones per pixel.
const float kBroadLobe = 0.1;  // GGX alpha
#endif
