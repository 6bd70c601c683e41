#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/clearcoat.glsl"
#include "screen/object_surface.glsl"
layout(location = 3) out vec4 out_emission;  // a: fraction that passes; opaque: pack_coat

void main() {
  float layers = draw.tint.y > 0.0 ? surface_transmission(uv) : draw.coat.x > 0.0 ? pack_coat(surface_coat(uv)) : 0.0;
  out_emission = vec4(surface_emission(write_surface(), uv, tint), layers);
}
