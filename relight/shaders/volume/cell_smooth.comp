#version 460
#extension GL_GOOGLE_include_directive : require
// Reduces the noise of few cones in the cells' irradiance: each cell is averaged with its neighbours whose surface has
// a similar normal. Cells near objects, where light varies from cell to cell, keep their value.
#include "volume/volume.glsl"
#include "volume/cells.glsl"
#include "common/slice.glsl"
#include "common/half.glsl"
layout(binding = 7) uniform sampler3D real_normal;
layout(binding = 8, rgba16f) uniform readonly image3D rough;  // times weight, weight
layout(binding = 18, rgba16f) uniform writeonly image3D irradiance;

const float kOwn = 1.0, kAllAround = 3.0;  // cells from the objects: keeps its own, takes the full mean
const float kNarrow = 0.6;                 // weight of a neighbour; two steps away its square

vec3 normal_of(ivec3 at, int cells) {
  int c = at.z / cells;
  vec3 normal = chunk_linear(real_normal, kReal, c, vec3(2 * ivec3(at.xy, at.z - c * cells) + 1), 0).xyz;
  return normal / max(length(normal), 1e-6);
}

void main() {
  int cells = frame.grid.x / 2;
  for (uint i = slice_first(); i < cells_listed(); i += slice_stride()) {
    ivec3 at = listed_cell(i);
    int c = at.z / cells;
    vec4 own = imageLoad(rough, at), sum = own;
    float size = 2.0 * frame.cascade[c].w;
    vec3 p = frame.cascade[c].xyz + size * (vec3(at.xy, at.z - c * cells) + 0.25), n = normal_of(at, cells);
    float wide = clamp((virtual_distance(p) / size - kOwn) / (kAllAround - kOwn), 0.0, 1.0);
    ivec3 low = ivec3(0, 0, c * cells), high = low + cells - 1;
    int around = own.a > 0.0 && wide > 0.0 ? 27 : 0;
    for (int j = 0; j < around; ++j) {
      ivec3 o = ivec3(j % 3, j / 3 % 3, j / 9) - 1, to = at + o;
      if (o == ivec3(0) || any(lessThan(to, low)) || any(greaterThan(to, high))) continue;
      float alike = max(dot(n, normal_of(to, cells)), 0.0);
      alike *= alike;
      sum += imageLoad(rough, to) * (wide * pow(kNarrow, float(dot(o, o))) * alike * alike);
    }
    if (own.a > 0.0) imageStore(irradiance, at, to_half(vec4(sum.rgb * (own.a / sum.a), own.a)));
  }
}
