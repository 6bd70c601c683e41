#version 460
#extension GL_GOOGLE_include_directive : require
// Real surfaces of known material.
#include "screen/object_surface.glsl"

void main() { write_surface(); }
