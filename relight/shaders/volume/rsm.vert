#version 460
#extension GL_GOOGLE_include_directive : require
// Projects a virtual object into the view from a lamp.
#include "common/interop.h"
layout(std140, binding = 0) uniform Draw { DrawParams draw; };
layout(location = 0) in vec3 position_m;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 texcoords;  // both sets
layout(location = 3) in vec3 color;
layout(location = 0) out vec3 world;
layout(location = 1) out vec4 uv;
layout(location = 2) out vec3 tint;
layout(location = 3) out vec3 world_normal;

void main() {
  world = (draw.T_tag_model * vec4(position_m, 1.0)).xyz;
  vec3 v = (draw.T_view_tag * vec4(world, 1.0)).xyz;  // the lamp looks along +z
  float near = draw.more.y, far = draw.more.x;
  gl_Position = vec4(v.xy * draw.projection.x, (v.z - near) * far / (far - near), v.z);
  world_normal = mat3(draw.T_tag_model) * normal;
  uv = texcoords;
  tint = color;
}
