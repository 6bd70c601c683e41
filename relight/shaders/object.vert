#version 460
#extension GL_GOOGLE_include_directive : require
// A virtual object seen by the camera, lens distortion included (Brown 1966, applied to vertices).
#include "interop.h"
layout(std140, binding = 0) uniform Draw { DrawParams draw; };
layout(location = 0) in vec3 position_m;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 texcoord;
layout(location = 3) in vec3 color;
layout(location = 0) out vec3 world;
layout(location = 1) out vec3 world_normal;
layout(location = 2) out vec2 uv;
layout(location = 3) out vec3 tint;
layout(location = 4) out float depth_m;

void main() {
  world = (draw.T_tag_model * vec4(position_m, 1.0)).xyz;
  vec3 c = (draw.T_view_tag * vec4(world, 1.0)).xyz;
  float z = max(c.z, 1e-4);
  vec2 q = c.xy / z;
  float r2 = min(dot(q, q), 4.0);
  float radial = 1.0 + r2 * (draw.distortion.x + r2 * (draw.distortion.y + r2 * draw.more.x));
  vec2 p = draw.distortion.zw;
  vec2 distorted = q * radial + 2.0 * p * q.x * q.y + p.yx * (r2 + 2.0 * q * q);
  vec2 pixel = draw.projection.xy * distorted + draw.projection.zw + 0.5;  // pixel centres are at integers
  float near = draw.more.y;
  gl_Position = vec4((2.0 * pixel / draw.more.zw - 1.0) * c.z, c.z - near, c.z);
  world_normal = mat3(draw.T_tag_model) * normal;  // similarity transforms: no inverse transpose needed
  uv = texcoord;
  tint = color;
  depth_m = c.z;
}
