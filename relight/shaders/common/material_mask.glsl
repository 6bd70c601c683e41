// How much of a pixel shows a known surface and how much the tag's paper that lies on it. A paper's edge would else be
// a row of pixels that lose a mirror's light from the paper's brightness.
#ifndef KNOWN_SHARE_GLSL
#define KNOWN_SHARE_GLSL
#include "common/frame.glsl"

// Both in one number: that of the surface, plus a fraction that grows with the paper's share.
const float kMostPaper = 0.9;
float pack_known(float number, float paper) { return number + kMostPaper * paper; }
float paper_share(float packed) { return packed > 0.0 ? fract(packed) / kMostPaper : 0.0; }

// Metal and nothing else: what light falls on it evenly is all the same.
bool is_metal(float packed) {
  int known = int(packed);
  return known > 0 && paper_share(packed) == 0.0 && frame.surfaces[known - 1].metallic_specular.x == 1.0;
}

// The paper's share of a pixel, by 4 × 4 rays through it: w is the pixel's per metre of z, and how much further the next
// pixels' point.
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
