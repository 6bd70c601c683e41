#version 460
#extension GL_GOOGLE_include_directive : require
#include "screen/object_surface.glsl"
layout(location = 3) out vec4 out_emission;  // a: fraction that passes

void main() {
  out_emission = vec4(surface_emission(write_surface(), uv, tint), draw.tint.y > 0.0 ? surface_transmission(uv) : 0.0);
}
