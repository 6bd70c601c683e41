#version 460
#extension GL_GOOGLE_include_directive : require
// Which share of the light that leaves the cells around gets into each cell, past the surfaces of the room and of the
// objects. The light of a cell is in the open part of it, so light that runs along a surface is not weakened by it.
// Four lines through every face, half a cell apart and half a cell off all grid planes.
#include "volume.glsl"
#include "lpv.glsl"
layout(local_size_x = 8, local_size_y = 4, local_size_z = 2) in;
layout(binding = 12, rgba16f) uniform writeonly image3D from_low;   // from the cells at -x, -y, -z; open part of the volume
layout(binding = 13, rgba16f) uniform writeonly image3D from_high;  // from the cells at +x, +y, +z

float nearest(vec3 p) { return min(real_distance(p), virtual_distance(p)); }

void main() {
  ivec3 at = ivec3(gl_GlobalInvocationID);
  int n = frame.pass_i.x;
  if (any(greaterThanEqual(at, ivec3(n, n, kCascades * n)))) return;
  int c = at.z / n;
  float cell = lpv_cell_m(c), sharp = 4.0 / cell;
  ivec3 place = ivec3(at.xy, at.z - c * n);
  vec3 p = lpv_low(c) + cell * (vec3(place) + 0.5);
  float middle = nearest(p);
  bool by_surface = abs(middle) < 1.5 * cell;
  float open = middle > 0.0 ? 1.0 : 0.0, share[6] = float[](open, open, open, open, open, open), volume = 0.0;
  for (int i = 0; i < (by_surface ? 8 : 0); ++i) {
    vec3 o = 0.5 * vec3(i & 1, (i >> 1) & 1, i >> 2) - 0.25;
    volume += 0.125 * clamp(0.5 + 2.0 / cell * nearest(p + cell * o), 0.0, 1.0);
  }
  for (int face = 0; face < (by_surface ? 6 : 0); ++face) {
    vec3 a = lpv_axis(face), u = a.yzx, v = a.zxy;
    float leaves = 0.0, enters = 0.0;
    for (int i = 0; i < 4; ++i) {
      vec3 on_face = p + cell * (0.5 * a + (0.5 * float(i & 1) - 0.25) * u + (0.5 * float(i >> 1) - 0.25) * v);
      float outside = clamp(sharp * nearest(on_face + 0.25 * cell * a), 0.0, 1.0);
      float there = clamp(sharp * nearest(on_face), 0.0, 1.0);
      float inside = clamp(sharp * nearest(on_face - 0.25 * cell * a), 0.0, 1.0);
      leaves += outside;
      enters += min(outside, min(there, inside));
    }
    share[face] = leaves > 1e-3 ? enters / leaves : 0.0;
  }
  // Nothing comes from beyond the volume.
  vec3 low = mix(vec3(share[1], share[3], share[5]), vec3(0), equal(place, ivec3(0)));
  vec3 high = mix(vec3(share[0], share[2], share[4]), vec3(0), equal(place, ivec3(n - 1)));
  imageStore(from_low, at, vec4(low, by_surface ? volume : open));
  imageStore(from_high, at, vec4(high, 0.0));
}
