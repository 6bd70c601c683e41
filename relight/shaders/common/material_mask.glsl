// Fractions of a pixel that show a surface of known material and the tag's paper on it. Without this, pixels at the
// paper's edge would lose a mirror's light in proportion to the paper's brightness.
#ifndef MATERIAL_MASK_GLSL
#define MATERIAL_MASK_GLSL
#include "common/frame.glsl"

// Both packed into one number: the surface's number plus a fraction that grows with the paper's coverage.
const float kMaxPaper = 0.9;
float pack_known(float number, float paper) { return number + kMaxPaper * paper; }
float paper_coverage(float packed) { return packed > 0.0 ? fract(packed) / kMaxPaper : 0.0; }

// Whether the surface is a pure metal: its diffuse part is zero, so the change of irradiance does not affect it.
bool is_metal(float packed) {
  int known = int(packed);
  return known > 0 && paper_coverage(packed) == 0.0 && frame.surfaces[known - 1].metallic_specular.x == 1.0;
}

// Fraction of a pixel that shows the paper, by 4 × 4 rays through it: w is the pixel's ray per metre of z; right, down:
// offsets to the neighbouring pixels' points.
float paper_in_pixel(vec3 p, vec3 w, vec3 right, vec3 down) {
  vec3 eye = frame.T_tag_camera[3].xyz;
  bool near = abs(p.z) < 0.01 && all(lessThan(abs(p.xy), vec2(1.5 * frame.tag.x)));
  float inside = 0.0;
  for (int i = 0; i < (near ? 16 : 0); ++i) {
    vec3 v = w + (0.25 * float(i & 3) - 0.375) * right + (0.25 * float(i >> 2) - 0.375) * down;
    vec2 q = eye.xy - eye.z / v.z * v.xy;
    inside += all(lessThan(abs(q), frame.tag.xx)) ? 1.0 / 16.0 : 0.0;
  }
  return inside;
}
#endif
