#version 460
#extension GL_GOOGLE_include_directive : require
// Change of irradiance on the real surface of every pixel in the influence mask.
#include "lpv/lpv_query.glsl"
#include "common/half.glsl"
#include "common/tiles.glsl"
layout(binding = 12) uniform sampler2D real_position;
layout(binding = 13) uniform sampler2D real_normal;
layout(binding = 14) uniform sampler3D beyond;  // the enclosure's contribution at cells, times weight, weight
layout(binding = 16, rgba16f) uniform writeonly image2D out_change;

void main() {
  ivec2 at = tile_texel();
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  vec4 normal = texelFetch(real_normal, at, 0);
  vec3 e = vec3(0);
  if (normal.a > 0.0) {
    vec3 p = texelFetch(real_position, at, 0).xyz;
    vec4 more = textureLod(beyond, cascade_place(in_cascade(0, p, 1.0) ? 0 : 1, p, 1.0), 0.0);
    e = lpv_irradiance(p, normalize(normal.xyz)) + (more.a > 1e-3 ? more.rgb / more.a : vec3(0));
  }
  imageStore(out_change, at, to_half(vec4(e, 0.0)));
}
