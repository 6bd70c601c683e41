// Where the camera shows a point, lens distortion included (Brown 1966, applied to vertices).
#ifndef CAMERA_VERTEX_GLSL
#define CAMERA_VERTEX_GLSL
#include "common/interop.h"
layout(std140, binding = 0) uniform Draw { DrawParams draw; };

vec4 camera_position(vec3 c) {
  float z = max(c.z, 1e-4);
  vec2 q = c.xy / z;
  float r2 = min(dot(q, q), 4.0);
  float radial = 1.0 + r2 * (draw.distortion.x + r2 * (draw.distortion.y + r2 * draw.more.x));
  vec2 p = draw.distortion.zw;
  vec2 distorted = q * radial + 2.0 * p * q.x * q.y + p.yx * (r2 + 2.0 * q * q);
  vec2 pixel = draw.projection.xy * distorted + draw.projection.zw + 0.5;  // pixel centres are at integers
  float near = draw.more.y;
  return vec4((2.0 * pixel / draw.more.zw - 1.0) * c.z, c.z - near, c.z);
}
#endif
