// Vertex of a virtual object, projected into the camera view. For vertex shaders alone.
#ifndef OBJECT_VERTEX_GLSL
#define OBJECT_VERTEX_GLSL
#include "common/camera_vertex.glsl"
layout(location = 0) in vec3 position_m;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 texcoords;  // both sets
layout(location = 3) in vec3 color;
layout(location = 4) in vec4 tangent;  // handedness in a; zero: none
layout(location = 0) out vec3 world;
layout(location = 1) out vec3 world_normal;
layout(location = 2) out vec4 uv;
layout(location = 3) out vec3 tint;
layout(location = 4) out float depth_m;
layout(location = 7) out vec4 world_tangent;

void project_vertex() {
  world = (draw.T_tag_model * vec4(position_m, 1.0)).xyz;
  vec3 c = (draw.T_view_tag * vec4(world, 1.0)).xyz;
  gl_Position = camera_position(c);
  world_normal = mat3(draw.T_tag_model) * normal;  // similarity transforms: no inverse transpose needed
  world_tangent = vec4(mat3(draw.T_tag_model) * tangent.xyz / length(draw.T_tag_model[0].xyz), tangent.w);
  uv = texcoords;
  tint = color;
  depth_m = c.z;
}
#endif
