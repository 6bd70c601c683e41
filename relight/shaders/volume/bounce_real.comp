#version 460
#extension GL_GOOGLE_include_directive : require
// Change of irradiance on real surfaces (thesis eq. 3.13, 5.21), gathered from the current volumes, once per listed
// cell. Independent of the view; varies over a cell as little as the voxels that it is gathered from.
#include "volume/gather.glsl"
#include "volume/cells.glsl"
#include "volume/cell_surface.glsl"
#include "volume/mirror_lamp.glsl"
#include "common/slice.glsl"
#include "common/half.glsl"
layout(binding = 18, rgba16f) uniform writeonly image3D irradiance;  // times weight, weight

void main() {
  for (uint i = slice_first(); i < cells_listed(); i += slice_stride()) {
    ivec3 at = listed_cell(i);
    CellSurface surface = cell_surface(at);
    if (surface.weight == 0.0) continue;
    vec3 on = surface.p, n = surface.n, off = on + cone_start_m() * n;
    vec3 gained, lost;
    gather_delta(on, off, n, frame.counts.y, cell_turn(at), gained, lost);
    vec3 e = gained - lost + gather_change(off, on, n, frame.pass_i.x, cell_turn(at));
    // Light of lamps lost by way of mirrors, if the result is used by other surfaces.
    e -= mirrored_lost(on, n, cone_from_real(on, n), frame.pass_i.y, cell_turn(at));
    imageStore(irradiance, at, to_half(vec4(e * surface.weight, surface.weight)));
  }
}
