#version 460
#extension GL_GOOGLE_include_directive : require
// Resamples the fused field's distances into both cascades, which are stacked along z. pass_i.w: first layer.
#include "common/bricks.glsl"
#include "common/half.glsl"
layout(local_size_x = 8, local_size_y = 4, local_size_z = 2) in;
layout(binding = 1, r16f) uniform writeonly image3D out_distance;

void main() {
  ivec3 at = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, frame.pass_i.w);
  int n = frame.grid.x;
  if (any(greaterThanEqual(at, ivec3(n, n, kCascades * n)))) return;
  int c = at.z / n;
  vec3 p = frame.cascade[c].xyz + frame.cascade[c].w * vec3(at.xy, at.z - c * n);
  float d, truncation = frame.field.y;
  bool known = field_distance(p, d);
  if (!known || d > 0.95 * truncation) d = max(far_distance(p), truncation);
  imageStore(out_distance, at, vec4(to_half(d)));
}
