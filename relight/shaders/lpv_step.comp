#version 460
#extension GL_GOOGLE_include_directive : require
// One step of propagation (thesis §5.3.1): every cell gathers what the six around it send its way. It adds its source, so
// after k steps the volume holds the light of 0 to k steps, and no accumulator is needed.
#include "lpv.glsl"
layout(local_size_x = 8, local_size_y = 4, local_size_z = 2) in;
layout(binding = 1, rgba32f) uniform readonly image3D source_red;
layout(binding = 2, rgba32f) uniform readonly image3D source_green;
layout(binding = 3, rgba32f) uniform readonly image3D source_blue;
layout(binding = 4, rgba32f) uniform readonly image3D in_red;
layout(binding = 5, rgba32f) uniform readonly image3D in_green;
layout(binding = 6, rgba32f) uniform readonly image3D in_blue;
layout(binding = 7, rgba16f) uniform readonly image3D from_low;
layout(binding = 8, rgba16f) uniform readonly image3D from_high;
layout(binding = 12, rgba32f) uniform writeonly image3D out_red;
layout(binding = 13, rgba32f) uniform writeonly image3D out_green;
layout(binding = 14, rgba32f) uniform writeonly image3D out_blue;

// low, high: what the cells to either side along x hold, times what gets in. x is the axis; the rest of J turns with it.
vec4 gather(vec4 low, vec4 high) {
  vec4 sum = low + high, off = low - high;
  return vec4(kLpvStay * sum.x + kLpvAhead * off.y, kLpvLift * off.x + kLpvAlong * sum.y, kLpvAcross * sum.zw);
}

#define GATHER(volume)                                                                                       \
  (gather(low.x * imageLoad(volume, x0), high.x * imageLoad(volume, x1)) +                                   \
   gather(low.y * imageLoad(volume, y0).xzwy, high.y * imageLoad(volume, y1).xzwy).xwyz +                    \
   gather(low.z * imageLoad(volume, z0).xwyz, high.z * imageLoad(volume, z1).xwyz).xzwy)

void main() {
  ivec3 at = ivec3(gl_GlobalInvocationID);
  int n = frame.pass_i.x;
  if (any(greaterThanEqual(at, ivec3(n, n, kCascades * n)))) return;
  // Beyond the edge, and in the other cascade, nothing gets in; any place inside will do.
  ivec3 last = ivec3(n, n, kCascades * n) - 1, x0 = max(at - ivec3(1, 0, 0), 0), x1 = min(at + ivec3(1, 0, 0), last),
        y0 = max(at - ivec3(0, 1, 0), 0), y1 = min(at + ivec3(0, 1, 0), last), z0 = max(at - ivec3(0, 0, 1), 0),
        z1 = min(at + ivec3(0, 0, 1), last);
  vec3 low = imageLoad(from_low, at).xyz, high = imageLoad(from_high, at).xyz;
  imageStore(out_red, at, imageLoad(source_red, at) + GATHER(in_red));
  imageStore(out_green, at, imageLoad(source_green, at) + GATHER(in_green));
  imageStore(out_blue, at, imageLoad(source_blue, at) + GATHER(in_blue));
}
