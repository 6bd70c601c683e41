#version 460
#extension GL_GOOGLE_include_directive : require
// As live_object.comp, where the objects' radiance depends on the view and was computed per pixel.
#include "common/finite.glsl"
#include "common/frame.glsl"
#include "common/half.glsl"
#include "common/tiles.glsl"
layout(binding = 11) uniform sampler2D object_radiance;
layout(binding = 14) uniform sampler2D object_surface;  // z, coverage
layout(binding = 13, rgba16f) uniform writeonly image2D out_object;
layout(binding = 15, r32f) uniform writeonly image2D out_z;

void main() {
  ivec2 at = tile_texel();
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  vec4 surface = texelFetch(object_surface, at, 0);
  float coverage = surface.y;
  vec3 object = max(finite_or_zero(texelFetch(object_radiance, at, 0).rgb), vec3(0));
  imageStore(out_object, at, to_half(vec4(coverage * object, coverage)));
  imageStore(out_z, at, vec4(surface.x));
}
