// Radiance of a surface of known material where the tag's paper covers part of the pixel: estimated from the pixels
// around. For passes that declare `radiance` of the camera and `real_albedo`, and include material_mask.glsl.
#ifndef WITHOUT_PAPER_GLSL
#define WITHOUT_PAPER_GLSL
vec3 exclude_tag(ivec2 at, vec3 own, float packed) {
  vec4 sum = vec4(0);
  for (int i = 0; i < (paper_coverage(packed) > 0.0 ? 25 : 0); ++i) {
    ivec2 q = clamp(at + ivec2(i % 5, i / 5) - 2, ivec2(0), frame.picture.xy - 1);
    bool uncovered = texelFetch(real_albedo, q, 0).a == floor(packed);
    sum += uncovered ? vec4(texelFetch(radiance, q, 0).rgb, 1.0) : vec4(0);
  }
  return sum.a > 0.0 ? sum.rgb / sum.a : own;
}
#endif
