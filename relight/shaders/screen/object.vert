#version 460
#extension GL_GOOGLE_include_directive : require
// Projects a virtual object into the camera view.
#include "screen/object_vertex.glsl"

void main() { project_vertex(); }
