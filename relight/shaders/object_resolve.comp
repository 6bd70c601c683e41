#version 460
#extension GL_GOOGLE_include_directive : require
// The supersampled object buffer becomes one surface a pixel with its coverage; samples behind real surfaces don't count.
#include "frame.glsl"
#include "half.glsl"
#include "tiles.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 1) uniform sampler2D sample_normal;
layout(binding = 2) uniform sampler2D sample_base;
layout(binding = 3) uniform sampler2D sample_depth;
layout(binding = 4) uniform sampler2D real_position;                     // a: z in the camera, 0: unknown
layout(binding = 12, rgba16f) uniform writeonly image2D object_normal;   // a: roughness
layout(binding = 13, rgba16f) uniform writeonly image2D object_base;     // a: metallic
layout(binding = 14, rgba32f) uniform writeonly image2D object_surface;  // z, coverage, specular

void main() {
  ivec2 at = tile_texel();
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  int s = frame.picture.w;
  float real = texelFetch(real_position, at, 0).a;
  // Contact: an object that stands on a real surface is not cut by that surface's own error.
  float behind = real > 0.0 ? real + max(0.3 * frame.field.x, 0.003 * real) : 1e9;
  vec4 normal = vec4(0), base = vec4(0);
  float z = 0.0, specular = 0.0;
  int covered = 0;
  for (int i = 0; i < s * s; ++i) {
    ivec2 q = s * at + ivec2(i % s, i / s);
    vec2 depth = texelFetch(sample_depth, q, 0).xy;
    if (depth.y == 0.0 || depth.x > behind) continue;
    ++covered;
    normal += texelFetch(sample_normal, q, 0);
    base += texelFetch(sample_base, q, 0);
    z += depth.x;
    specular += mod(depth.y, 2.0);
  }
  float k = covered > 0 ? 1.0 / float(covered) : 0.0;
  float l = length(normal.xyz);
  imageStore(object_normal, at, to_half(vec4(l > 1e-6 ? normal.xyz / l : vec3(0, 0, 1), normal.a * k)));
  imageStore(object_base, at, to_half(base * k));
  imageStore(object_surface, at, vec4(z * k, float(covered) / float(s * s), specular * k, 0.0));
}
