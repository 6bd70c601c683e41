#version 460
#extension GL_GOOGLE_include_directive : require
// Radiance of a matt virtual surface.
#include "common/surface_material.glsl"
layout(location = 0) in vec3 world;
layout(location = 1) in vec3 world_normal;
layout(location = 2) in vec4 uv;
layout(location = 3) in vec3 tint;
layout(location = 4) in float depth_m;
layout(location = 5) in vec3 front;
layout(location = 6) in vec3 back;
layout(location = 0) out vec4 out_sample;  // radiance; metres along z

void main() {
  vec3 eye = -(transpose(mat3(draw.T_view_tag)) * draw.T_view_tag[3].xyz);
  bool behind = dot(world_normal, eye - world) < 0.0 && !gl_FrontFacing;
  const float kPi = 3.14159265358979;
  vec3 reflected = is_unlit() ? vec3(0) : surface_color(uv, tint) / kPi * (behind ? back : front);
  out_sample = vec4(reflected + surface_emission(!behind, uv, tint), depth_m);
}
