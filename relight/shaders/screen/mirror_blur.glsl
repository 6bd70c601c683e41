// How far a real surface's lobe blurs what it shows of the objects, in pixels.
#ifndef MIRROR_BLUR_GLSL
#define MIRROR_BLUR_GLSL
#include "volume/volume.glsl"

// Slopes of microfacets of about α turn a mirrored ray by twice that. What stands at distance b from p, seen by an eye at
// distance a, spreads over 2α / (1/a + 1/b) around p.
float mirror_blur_px(float alpha, vec3 p) {
  float near = max(virtual_distance(p), 0.0), far = length(frame.T_tag_camera[3].xyz - p);
  return 2.0 * alpha * near * frame.pinhole.x / (near + far);
}
#endif
