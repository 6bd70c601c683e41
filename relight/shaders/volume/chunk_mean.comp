#version 460
#extension GL_GOOGLE_include_directive : require
// The next level of a hierarchy: the mean of eight texels, chunk by chunk, including each chunk's copies of its
// neighbours' texels. Values are premultiplied by their weight, so the mean of a signed change is filtered exactly as
// the radiance it changes. pass_i: number of the level's first chunk, the level, kind of surface.
#include "volume/chunks.glsl"
#include "common/half.glsl"
layout(local_size_x = 64) in;
layout(binding = 1, rgba16f) uniform image3D pool;
layout(std430, binding = 2) readonly buffer Places { uint places[]; };  // of chunk 1 and up: 5 bits x, y, z; cascade

void main() {
  uint number = uint(frame.pass_i.x) + gl_WorkGroupID.x, place = places[number - 1u];
  int level = frame.pass_i.y, kind = frame.pass_i.z, c = int(place >> 15), n = frame.grid.x >> level;
  ivec3 chunk = ivec3(place, place >> 5, place >> 10) & 31, first = chunk_texel(number);
  const int edge = kChunkEdge + 1;
  for (int i = int(gl_LocalInvocationID.x); i < edge * edge * edge; i += 64) {
    ivec3 at = ivec3(i % edge, i / edge % edge, i / (edge * edge)), fine = 2 * (kChunkEdge * chunk + at);
    vec4 sum = vec4(0);
    if (all(lessThan(fine, ivec3(2 * n)))) {
      ivec3 from = chunk_texel(chunk_at(kind, c, level - 1, fine >> 3)) + (fine & 7);
      for (int j = 0; j < 8; ++j) sum += imageLoad(pool, from + ivec3(j & 1, (j >> 1) & 1, j >> 2));
    }
    imageStore(pool, first + at, to_half(sum * 0.125));
  }
}
