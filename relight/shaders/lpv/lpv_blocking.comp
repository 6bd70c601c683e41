#version 460
#extension GL_GOOGLE_include_directive : require
// Fraction of the light leaving the neighbouring cells that enters each cell, past the surfaces of the room and the
// objects. A cell's light is in its open part, so light parallel to a surface is not attenuated by it. Sampled by four
// lines through every face, half a cell apart and half a cell off all grid planes.
#include "volume/volume.glsl"
#include "lpv/lpv.glsl"
layout(local_size_x = 8, local_size_y = 4, local_size_z = 2) in;
layout(binding = 12, rgba16f) uniform writeonly image3D from_low;  // from -x, -y, -z; open fraction
layout(binding = 13, rgba16f) uniform writeonly image3D from_high;  // from the neighbours at +x, +y, +z

void main() {
  ivec3 at = ivec3(gl_GlobalInvocationID);
  int n = frame.pass_i.x, c = at.z / n;
  if (any(greaterThanEqual(at, ivec3(n, n, kCascades * n)))) return;
  float cell = lpv_cell_m(c);
  ivec3 place = ivec3(at.xy, at.z - c * n);
  vec3 p = lpv_low(c) + cell * (vec3(place) + 0.5);
  float real = real_distance(p), virt = virtual_distance(p), middle = min(real, virt);
  // No sample is farther away than 0.83 cells, and each covers at most a quarter of a cell.
  float reach = 1.1 * cell;
  bool by_real = abs(real) < reach, by_virtual = abs(virt) < reach, by_surface = by_real || by_virtual;
  float open = middle > 0.0 ? 1.0 : 0.0, volume = open, fraction[6] = float[](open, open, open, open, open, open);
  for (int near = 0; near < (by_surface ? 1 : 0); ++near) {  // unlike a branch, free on software devices if not entered
    volume = 0.0;
    float here[8];
    for (int i = 0; i < 8; ++i) {
      vec3 q = p + cell * (0.5 * vec3(i & 1, (i >> 1) & 1, i >> 2) - 0.25);
      float d = min(by_real ? real_distance(q) : real, by_virtual ? virtual_distance(q) : virt) / cell;
      volume += 0.125 * clamp(0.5 + 2.0 * d, 0.0, 1.0);
      here[i] = clamp(4.0 * d, 0.0, 1.0);
    }
    for (int face = 0; face < 6; ++face) {
      vec3 a = lpv_axis(face);
      float leaves = 0.0, enters = 0.0;
      for (int k = 0; k < 4; ++k) {
        // The four corners of eight on this face.
        int axis = face / 2, low_bits = (1 << axis) - 1, i = ((k & ~low_bits) << 1) | (k & low_bits) | ((1 - face % 2) << axis);
        vec3 o = 0.5 * vec3(i & 1, (i >> 1) & 1, i >> 2) - 0.25;
        float through = here[i], outside = 0.0;
        for (int j = 1; j <= 2; ++j) {  // on the face, and behind it
          vec3 q = p + cell * (o + 0.25 * float(j) * a);
          float d = min(by_real ? real_distance(q) : real, by_virtual ? virtual_distance(q) : virt) / cell;
          outside = clamp(4.0 * d, 0.0, 1.0);
          through = min(through, outside);
        }
        leaves += outside;
        enters += through;
      }
      fraction[face] = leaves > 1e-3 ? enters / leaves : 0.0;
    }
  }
  // Nothing enters from outside the volume.
  vec3 low = mix(vec3(fraction[1], fraction[3], fraction[5]), vec3(0), equal(place, ivec3(0)));
  vec3 high = mix(vec3(fraction[0], fraction[2], fraction[4]), vec3(0), equal(place, ivec3(n - 1)));
  imageStore(from_low, at, vec4(low, volume));
  imageStore(from_high, at, vec4(high, 0.0));
}
