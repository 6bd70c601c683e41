#version 460
#extension GL_GOOGLE_include_directive : require
// Resolves the supersampled object buffer to one surface and its coverage per pixel, and a second surface where an edge
// runs through the pixel; hidden samples are ignored.
#include "common/clearcoat.glsl"
#include "common/frame.glsl"
#include "common/half.glsl"
#include "common/tiles.glsl"
#include "screen/real_in_front.glsl"
layout(binding = 1) uniform sampler2D sample_normal;
layout(binding = 2) uniform sampler2D sample_base;
layout(binding = 3) uniform sampler2D sample_depth;
layout(binding = 4) uniform sampler2D real_position;                     // a: z in the camera frame, 0: unknown
layout(binding = 5) uniform sampler2D rays;                              // x/z, y/z per pixel
layout(binding = 6) uniform sampler2D depth;                             // metres along z, 0: none
layout(binding = 7) uniform sampler2D sample_emission;
layout(binding = 12, rgba16f) uniform writeonly image2D object_normal;   // a: roughness
layout(binding = 13, rgba16f) uniform writeonly image2D object_base;     // a: metallic; + 2: glTF; + 4 · Glass
layout(binding = 14, rgba32f) uniform writeonly image2D object_surface;  // z, coverage, specular, other's share
layout(binding = 15, rgba16f) uniform writeonly image2D object_other;    // that surface's normal; z
layout(binding = 16, rgba16f) uniform writeonly image2D object_emission;  // a: fraction that passes; opaque: pack_coat

// Samples with one normal at one depth are one surface, whose material is their mean. Of colours the mean is right for all
// light; where metal borders on a dielectric it is not, but nearer than one of both.
const float kSameNormal = 0.8, kSameDepth = 0.02;

struct Sum {
  vec4 normal, base;
  vec3 emission;
  float transmission;
  vec2 coat;  // intensity; that times roughness
  float z, specular;
  int count, gltf, glass;
};

const Sum kNone = Sum(vec4(0), vec4(0), vec3(0), 0.0, vec2(0), 0.0, 0.0, 0, 0, 0);

vec3 direction(vec3 sum) {
  float l = length(sum);
  return l > 1e-6 ? sum / l : vec3(0, 0, 1);
}

void main() {
  ivec2 at = tile_texel();
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  int s = frame.picture.w;
  float real = texelFetch(real_position, at, 0).a, measured = texelFetch(depth, at, 0).x;
  vec2 ray = texelFetch(rays, at, 0).xy;
  // The samples are split in two: those of the first covered sample's surface, and the others; the larger group is the
  // pixel's surface.
  Sum sums[2] = Sum[](kNone, kNone);
  vec3 first_normal = vec3(0);
  float first_z = 0.0;
  for (int i = 0; i < s * s; ++i) {
    ivec2 q = s * at + ivec2(i % s, i / s);
    vec2 found = texelFetch(sample_depth, q, 0).xy;
    if (found.y == 0.0 || hides(real, measured, found.x, ray)) continue;
    vec4 normal = texelFetch(sample_normal, q, 0), base = texelFetch(sample_base, q, 0);
    if (sums[0].count == 0) {
      first_normal = normal.xyz;
      first_z = found.x;
    }
    bool same = dot(normal.xyz, first_normal) > kSameNormal && abs(found.x - first_z) < kSameDepth * first_z;
    int which = same ? 0 : 1;
    sums[which].normal += normal;
    int glass = int(base.a / 4.0);
    base.a -= 4.0 * float(glass);
    sums[which].glass = max(sums[which].glass, glass);
    bool gltf = base.a > 1.5;
    sums[which].base += vec4(base.rgb, gltf ? base.a - 2.0 : base.a);
    sums[which].gltf += int(gltf);
    vec4 emission = texelFetch(sample_emission, q, 0);
    sums[which].emission += emission.rgb;
    if (glass > 0) {
      sums[which].transmission += emission.a;
    } else if (emission.a > 0.0) {
      vec2 coat = unpack_coat(emission.a);
      sums[which].coat += coat.x * vec2(1.0, coat.y);
    }
    sums[which].z += found.x;
    sums[which].specular += mod(found.y, 2.0);
    ++sums[which].count;
  }
  int covered = sums[0].count + sums[1].count;
  bool first = sums[0].count >= sums[1].count;
  Sum largest = first ? sums[0] : sums[1], other = first ? sums[1] : sums[0];
  float k = largest.count > 0 ? 1.0 / float(largest.count) : 0.0, all = max(float(covered), 1.0);
  imageStore(object_normal, at, to_half(vec4(direction(largest.normal.xyz), largest.normal.a * k)));
  vec4 base = largest.base * k;
  if (2 * largest.gltf > largest.count) base.a += 2.0;
  base.a = min(base.a, 3.0) + 4.0 * float(largest.glass);
  imageStore(object_base, at, to_half(base));
  imageStore(object_surface, at, vec4(largest.z * k, float(covered) / float(s * s), largest.specular * k,
                                      float(other.count) / all));
  float layers = largest.glass > 0 ? largest.transmission * k
                                   : pack_coat(vec2(largest.coat.x * k, largest.coat.y / max(largest.coat.x, 1e-6)));
  imageStore(object_emission, at, to_half(vec4(largest.emission * k, layers)));
  imageStore(object_other, at, to_half(vec4(direction(other.normal.xyz), other.z / max(float(other.count), 1.0))));
}
