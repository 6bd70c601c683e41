#version 460
#extension GL_GOOGLE_include_directive : require
// Adds the change of glossy surfaces of known material to the live frame: their reflection is not their own light times
// a factor, so it is added like the objects' radiance. pass_i.x: pixels along each axis per value of live_gain.
#include "common/finite.glsl"
#include "common/frame.glsl"
#include "common/material_mask.glsl"
#include "common/half.glsl"
#include "common/tiles.glsl"
layout(binding = 2) uniform sampler2D radiance;  // of the camera
layout(binding = 4) uniform sampler2D real_albedo;
layout(binding = 6) uniform sampler2D diffuse;
layout(binding = 7) uniform sampler2D mirror_gained;
layout(binding = 8) uniform sampler2D mirror_fraction;
layout(binding = 12, rgba16f) uniform writeonly image2D out_gain;
layout(binding = 13, rgba16f) uniform image2D object;  // radiance times coverage, coverage
#include "common/exclude_tag.glsl"

void main() {
  ivec2 at = tile_texel();
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  float known = texelFetch(real_albedo, at, 0).a;
  if (known == 0.0) return;
  vec3 b = texelFetch(radiance, at, 0).rgb;
  vec3 mirror = texelFetch(mirror_gained, at, 0).rgb - exclude_tag(at, b, known) * texelFetch(mirror_fraction, at, 0).rgb;
  vec3 delta = max(finite_or_zero(texelFetch(diffuse, at, 0).rgb + (1.0 - paper_coverage(known)) * mirror), -b);
  vec4 before = imageLoad(object, at);
  imageStore(object, at, to_half(vec4(before.rgb + (1.0 - before.a) * delta, before.a)));
  if (at % frame.pass_i.x == ivec2(0)) imageStore(out_gain, at / frame.pass_i.x, vec4(1));
}
