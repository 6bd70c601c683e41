#version 460
#extension GL_GOOGLE_include_directive : require
// Propagation (thesis §5.3.1): every cell gathers what its six neighbours send towards it and adds its source; the
// result is the sum of all steps so far, so no accumulator is needed. In place, alternating between even and odd cells
// (pass_i.y): a cell reads only cells of the other parity, light advances two cells per sweep, and every update is
// over-relaxed (successive over-relaxation, Young 1954).
#include "lpv/lpv.glsl"
layout(local_size_x = 8, local_size_y = 4, local_size_z = 2) in;
layout(binding = 1, rgba32f) uniform readonly image3D source_red;
layout(binding = 2, rgba32f) uniform readonly image3D source_green;
layout(binding = 3, rgba32f) uniform readonly image3D source_blue;
layout(binding = 4, rgba32f) uniform image3D light_red;
layout(binding = 5, rgba32f) uniform image3D light_green;
layout(binding = 6, rgba32f) uniform image3D light_blue;
layout(binding = 7, rgba16f) uniform readonly image3D from_low;
layout(binding = 8, rgba16f) uniform readonly image3D from_high;

// low, high: content of the two neighbours along x, times the fraction that enters. x is the propagation axis; the
// components of J are permuted accordingly.
vec4 gather(vec4 low, vec4 high) {
  vec4 sum = low + high, off = low - high;
  return vec4(kLpvStay * sum.x + kLpvAhead * off.y, kLpvLift * off.x + kLpvAlong * sum.y, kLpvAcross * sum.zw);
}

#define GATHER(volume)                                                                                       \
  (gather(low.x * imageLoad(volume, x0), high.x * imageLoad(volume, x1)) +                                   \
   gather(low.y * imageLoad(volume, y0).xzwy, high.y * imageLoad(volume, y1).xzwy).xwyz +                    \
   gather(low.z * imageLoad(volume, z0).xwyz, high.z * imageLoad(volume, z1).xwyz).xzwy)

void main() {
  int n = frame.pass_i.x;
  ivec3 at = ivec3(gl_GlobalInvocationID);
  at.x = 2 * at.x + ((at.y + at.z + frame.pass_i.y) & 1);
  if (any(greaterThanEqual(at, ivec3(n, n, kCascades * n)))) return;
  // Nothing enters from beyond the border or from the other cascade (the fraction is 0 there), so any valid index will
  // do.
  ivec3 last = ivec3(n, n, kCascades * n) - 1, x0 = max(at - ivec3(1, 0, 0), 0), x1 = min(at + ivec3(1, 0, 0), last),
        y0 = max(at - ivec3(0, 1, 0), 0), y1 = min(at + ivec3(0, 1, 0), last), z0 = max(at - ivec3(0, 0, 1), 0),
        z1 = min(at + ivec3(0, 0, 1), last);
  vec3 low = imageLoad(from_low, at).xyz, high = imageLoad(from_high, at).xyz;
  imageStore(light_red, at, mix(imageLoad(light_red, at), imageLoad(source_red, at) + GATHER(light_red), kLpvOver));
  imageStore(light_green, at, mix(imageLoad(light_green, at), imageLoad(source_green, at) + GATHER(light_green), kLpvOver));
  imageStore(light_blue, at, mix(imageLoad(light_blue, at), imageLoad(source_blue, at) + GATHER(light_blue), kLpvOver));
}
