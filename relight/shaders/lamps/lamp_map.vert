#version 460
#extension GL_GOOGLE_include_directive : require
// Projects a virtual object from a point of a lamp, into that map's part of the atlas (passes/lamps/lamp_maps.cpp).
#include "common/interop.h"
layout(std140, binding = 0) uniform Draw { DrawParams draw; };
layout(location = 0) in vec3 position_m;
layout(location = 0) out vec3 in_map;  // inside: |xy| < z

void main() {
  vec3 v = (draw.T_view_tag * (draw.T_tag_model * vec4(position_m, 1.0))).xyz;  // the lamp looks along +z
  in_map = vec3(v.xy * draw.more.z, v.z);
  gl_Position = vec4(in_map.xy * draw.projection.xy + draw.projection.zw * v.z, v.z * draw.more.x - draw.more.y, v.z);
}
