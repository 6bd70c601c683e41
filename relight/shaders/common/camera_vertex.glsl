// Projection of a point into the camera image, including lens distortion (Brown 1966, applied to vertices).
#ifndef CAMERA_VERTEX_GLSL
#define CAMERA_VERTEX_GLSL
#include "common/interop.h"
layout(std140, binding = 0) uniform Draw { DrawParams draw; };

// Outside the lens's field of view, where distortion would fold a point back into the image, and behind the camera, the
// projection is extended linearly from the field's edge.
vec4 camera_position(vec3 c) {
  float r = length(c.xy);
  bool beyond = r > draw.lens.x * c.z;
  vec2 q = beyond ? c.xy * (draw.lens.x / max(r, 1e-9)) : c.xy / max(c.z, 1e-4);
  float r2 = dot(q, q);
  float radial = 1.0 + r2 * (draw.distortion.x + r2 * (draw.distortion.y + r2 * draw.more.x));
  vec2 p = draw.distortion.zw;
  vec2 distorted = q * radial + 2.0 * p * q.x * q.y + p.yx * (r2 + 2.0 * q * q);
  vec2 pixel = draw.projection.xy * distorted + draw.projection.zw + 0.5;  // pixel centres are at integers
  float near = draw.more.y;
  vec2 at = (2.0 * pixel / draw.more.zw - 1.0) * c.z;
  if (beyond) at += 2.0 * draw.projection.xy / draw.more.zw * (c.xy - q * c.z);
  return vec4(at, c.z - near, c.z);
}
#endif
