// Influence mask: the pixels that the objects can change.
#ifndef FOOTPRINT_GLSL
#define FOOTPRINT_GLSL
#include "common/frame.glsl"

// How much the objects can change the indirect light at p, from the solid angle of the sphere around them: 0 where by
// less than pass_f.x pixel values (8 bit), fading in to 1 so that the mask has no visible edge. `root`: the brightest
// channel of the sRGB-coded image to the power of 1 / 2.4.
float indirect_footprint_of(vec3 p, vec3 n, float root, bool glossy) {
  vec3 to = frame.sphere.xyz - p;
  float far2 = dot(to, to), r2 = frame.sphere.w * frame.sphere.w;
  if (far2 < 1.5 * r2) return 1.0;
  float far = sqrt(far2);
  float max_cosine = clamp(dot(n, to) / far + frame.sphere.w / far, 0.0, 1.0);
  // For coded images: the change of the pixel value, with the slope of the sRGB curve above its linear part.
  root = clamp(root, 0.1, 1.0);
  float codes = 255.0 * 1.055 / 2.4 * root * (r2 / far2) * (glossy ? 4.0 : max_cosine);
  codes *= 1.0 + frame.exposure.a / pow(root, 2.4);  // objects that emit may be brighter than the room
  return clamp(codes / frame.pass_f.x - 1.0, 0.0, 1.0);
}
float indirect_footprint(vec3 p, vec3 n, vec3 b, bool glossy) {
  vec3 code = frame.exposure.rgb * b;
  float level = max(max(code.x, code.y), code.z);
  return indirect_footprint_of(p, n, pow(max(level, 0.004), 1.0 / 2.4), glossy);
}

const float kShadowOnly = 1e-3;  // mask value where only lamp shadows can change the pixel

// The same, and at least kShadowOnly where the objects may occlude a lamp.
float in_footprint(vec3 p, vec3 n, vec3 b, bool glossy) {
  float indirect = indirect_footprint(p, n, b, glossy), far = length(frame.sphere.xyz - p);
  if (indirect > 0.0) return max(indirect, kShadowOnly);
  for (int i = 0; i < frame.counts.x; ++i) {
    vec3 w = frame.lamps[i].position_radius.xyz - p;
    float l = length(w);
    vec2 hit = ray_sphere(p, w / l, frame.sphere.xyz, frame.sphere.w + far * frame.lamps[i].position_radius.w / l);
    if (hit.x < hit.y && hit.y > 0.0 && hit.x < l) return kShadowOnly;
  }
  return 0.0;
}
#endif
