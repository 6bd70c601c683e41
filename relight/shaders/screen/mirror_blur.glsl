// Blur of the objects' reflection by a real surface's lobe, in pixels.
#ifndef MIRROR_BLUR_GLSL
#define MIRROR_BLUR_GLSL
#include "volume/volume.glsl"

// Microfacet slopes of about α deflect a reflected ray by twice that. A point at distance b from p, viewed from
// distance a, is spread over 2α / (1/a + 1/b) around p.
float mirror_blur_px(float alpha, vec3 p) {
  float near = max(virtual_distance(p), 0.0), far = length(frame.T_tag_camera[3].xyz - p);
  return 2.0 * alpha * near * frame.pinhole.x / (near + far);
}
#endif
