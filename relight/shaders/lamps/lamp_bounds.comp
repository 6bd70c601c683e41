#version 460
#extension GL_GOOGLE_include_directive : require
// Computes the depth bounds of a lamp's map (lamp_bounds.glsl): one group per 32 × 32 texels of a map, one thread for
// each of its smallest blocks.
#include "common/interop.h"
#include "lamps/lamp_bounds.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 7) uniform sampler2D lamp_depths;
layout(std430, binding = 8) readonly buffer LampViews { LampMap lamp_views[]; };
layout(std430, binding = 11) writeonly buffer LampBounds { uint lamp_bounds[]; };
shared uint bounds[8][8];

void main() {
  LampMap m = lamp_views[gl_WorkGroupID.z];
  ivec2 block = ivec2(gl_GlobalInvocationID.xy), mine = ivec2(gl_LocalInvocationID.xy);
  int edge = int(m.more.x);
  vec2 low = vec2(1), high = vec2(0);
  for (int i = 0; i < 4; ++i) {
    vec2 corner = m.place.xy + vec2(kBoundBlock * block + 2 * ivec2(i & 1, i >> 1)) + 1.0;
    vec4 d = textureGather(lamp_depths, corner / vec2(textureSize(lamp_depths, 0)));
    low = min(low, min(d.xy, d.zw));
    high = max(high, max(d.xy, d.zw));
  }
  uint both = uint(floor(min(low.x, low.y) * kBoundScale)) << 16 | uint(ceil(max(high.x, high.y) * kBoundScale));
  for (int level = 0; level < kBoundLevels; ++level) {
    if (all(equal(mine & ((1 << level) - 1), ivec2(0)))) {
      ivec2 at = block >> level;
      lamp_bounds[int(m.from.w) + bound_level(edge, level) + at.y * (edge >> (kBoundShift + level)) + at.x] = both;
      bounds[mine.y][mine.x] = both;
    }
    barrier();
    if (level + 1 < kBoundLevels && all(equal(mine & ((2 << level) - 1), ivec2(0)))) {
      int next = 1 << level;
      uint a = bounds[mine.y][mine.x + next], b = bounds[mine.y + next][mine.x], c = bounds[mine.y + next][mine.x + next];
      both = min(min(both >> 16, a >> 16), min(b >> 16, c >> 16)) << 16 |
             max(max(both & 0xffffu, a & 0xffffu), max(b & 0xffffu, c & 0xffffu));
    }
    barrier();
  }
}
