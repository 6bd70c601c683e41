#version 460
#extension GL_GOOGLE_include_directive : require
// For 8 × 8 texels of a lamp's image (lamp_shadow.comp): which of its maps occlude part of their receivers and must be
// tested per texel, and which occlude all of them. The result of a map's bounds (lamp_bounds.glsl) for the bounding box
// of the receivers holds for every point in it. One thread per block.
#include "lamps/lamp_maps.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 9) uniform sampler2D ground_place;
layout(binding = 10) uniform sampler2D ground_normal;
layout(std430, binding = 16) writeonly buffer Blocks { uvec2 blocks[]; };  // bit masks of maps: partly, fully occluding

// 0: the map occludes nothing of the box; 1: all of it; -1: undecided.
float box_hidden(LampMap m, vec3 low, vec3 high) {
  vec2 first = vec2(1e9), last = vec2(-1e9);
  float near = 1e9, far = 0.0;
  for (int i = 0; i < 8; ++i) {
    vec3 d = mix(low, high, vec3(i & 1, (i >> 1) & 1, i >> 2)) - m.from.xyz;
    float z = dot(m.z.xyz, d);
    vec2 at = (0.5 + 0.5 * vec2(dot(m.x.xyz, d), dot(m.y.xyz, d)) / max(z, 1e-4)) * m.more.x - 0.5;
    first = min(first, at);
    last = max(last, at);
    near = min(near, z);
    far = max(far, z);
  }
  if (near <= 2.0 * kBefore_m) return -1.0;
  if (any(lessThan(last, vec2(-0.5))) || any(greaterThan(first, vec2(m.more.x - 0.5)))) return 0.0;
  float reach = max(kFurthestTap * disc_texels(m, far), 0.5);
  bool inside = all(greaterThan(first, vec2(-0.5))) && all(lessThan(last, vec2(m.more.x - 0.5)));
  float bounded = map_bounded(m, first - reach, last + reach, map_threshold(m, near - kBefore_m),
                              map_threshold(m, far - kBefore_m));
  return bounded == 1.0 && !inside ? -1.0 : bounded;
}

void main() {
  ivec2 block = ivec2(gl_GlobalInvocationID.xy);
  int across = textureSize(ground_place, 0).x / 8, lamp = block.y / across;
  if (block.x >= across || lamp >= frame.counts.x) return;
  vec3 low = vec3(1e9), high = vec3(-1e9);
  for (int i = 0; i < 64; ++i) {
    ivec2 at = 8 * block + ivec2(i & 7, i >> 3);
    vec3 p = texelFetch(ground_place, at, 0).xyz;
    bool lit = texelFetch(ground_normal, at, 0).a > 0.0;
    low = min(low, lit ? p : low);
    high = max(high, lit ? p : high);
  }
  int maps = int(frame.lamps[lamp].intensity.a), first = first_map_of(lamp);
  uvec2 hidden = uvec2(0);
  for (int i = 0; i < (low.x <= high.x ? maps : 0); ++i) {
    float all_of_it = box_hidden(lamp_views[first + i], low, high);
    hidden |= (uvec2(all_of_it < 0.0, all_of_it > 0.0) << uint(i));
  }
  blocks[block.y * across + block.x] = hidden;
}
