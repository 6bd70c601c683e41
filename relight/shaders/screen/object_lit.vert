#version 460
#extension GL_GOOGLE_include_directive : require
// Projects a virtual object into the camera view, with the irradiance computed by object_light.comp.
#include "common/camera_vertex.glsl"
layout(location = 0) in vec3 position_m;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 texcoord;
layout(location = 3) in vec3 color;
layout(std430, binding = 2) readonly buffer Light { vec4 light[]; };  // irradiance of the front side, then of the back
                                                                      // side
layout(location = 0) out vec3 world;
layout(location = 1) out vec3 world_normal;
layout(location = 2) out vec2 uv;
layout(location = 3) out vec3 tint;
layout(location = 4) out float depth_m;
layout(location = 5) out vec3 front;
layout(location = 6) out vec3 back;

void main() {
  world = (draw.T_tag_model * vec4(position_m, 1.0)).xyz;
  vec3 c = (draw.T_view_tag * vec4(world, 1.0)).xyz;
  gl_Position = camera_position(c);
  world_normal = mat3(draw.T_tag_model) * normal;  // similarity transforms: no inverse transpose needed
  uv = texcoord;
  tint = color;
  depth_m = c.z;
  front = light[2 * gl_VertexIndex].rgb;
  back = light[2 * gl_VertexIndex + 1].rgb;
}
