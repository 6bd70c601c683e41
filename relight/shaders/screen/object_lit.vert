#version 460
#extension GL_GOOGLE_include_directive : require
// Projects a virtual object into the camera view, with the irradiance computed by object_light.comp.
#include "screen/object_vertex.glsl"
layout(std430, binding = 2) readonly buffer Light { vec4 light[]; };  // irradiance of the front side, then of the back
layout(location = 5) out vec3 front;
layout(location = 6) out vec3 back;

void main() {
  project_vertex();
  front = light[2 * gl_VertexIndex].rgb;
  back = light[2 * gl_VertexIndex + 1].rgb;
}
