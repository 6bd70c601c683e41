#version 460
#extension GL_GOOGLE_include_directive : require
// Change of irradiance on real surfaces, once per listed cell: the source of the next bounce, and of the live setting's
// look-up. The enclosure's change is gathered by pass_i.y cones, because it originates outside the propagation grid.
#include "volume/gather.glsl"
#include "lpv/lpv_query.glsl"
#include "volume/cells.glsl"
#include "volume/cell_surface.glsl"
#include "common/half.glsl"
layout(local_size_x = 64) in;
layout(binding = 18, rgba16f) uniform writeonly image3D irradiance;  // times weight, weight
layout(binding = 27, rgba16f) uniform writeonly image3D out_beyond;  // the enclosure's part, likewise

void main() {
  for (uint i = gl_GlobalInvocationID.x; i < cells_listed(); i += gl_NumWorkGroups.x * 64u) {
    ivec3 at = listed_cell(i);
    CellSurface surface = cell_surface(at);
    if (surface.weight == 0.0) continue;
    vec3 on = surface.p, n = surface.n, beyond = vec3(0);
    if (frame.pass_i.y > 0) gather_change(on + cone_start_m() * n, on, n, frame.pass_i.y, cell_turn(at), beyond);
    imageStore(irradiance, at, to_half(vec4((lpv_irradiance(on, n) + beyond) * surface.weight, surface.weight)));
    imageStore(out_beyond, at, to_half(vec4(beyond * surface.weight, surface.weight)));
  }
}
