// Injects light of surfaces into the cell half a cell in front of them, in fixed point: integer sums do not depend on
// their order. Inputs are surface parts half as wide as a cell that fade in and out as surfaces move, so they need not
// be split over cells. The nearest open cell of 8 is used; if none is open the light is trapped and dropped.
#ifndef LPV_SPLAT_GLSL
#define LPV_SPLAT_GLSL
#include "lpv/lpv.glsl"
layout(std430, binding = 16) buffer Sums { int sums[]; };  // cell of both cascades; channel; Φ, J
layout(binding = 17, rgba16f) uniform readonly image3D openness;  // a: open part of the volume

// Columns of `light` are channels: Φ, J in units of pass_f.x.
void lpv_splat(int c, vec3 p, vec3 normal, mat3x4 light) {
  int n = frame.pass_i.x;
  vec3 g = lpv_place(c, p) + kLpvShift * normal - 0.5, f = fract(g);
  ivec3 base = ivec3(floor(g)), best = base;
  float max_weight = 0.0;
  for (int i = 0; i < 8; ++i) {
    ivec3 o = ivec3(i & 1, (i >> 1) & 1, i >> 2), at = base + o;
    vec3 w = mix(1.0 - f, f, vec3(o));
    bool inside = all(greaterThanEqual(at, ivec3(0))) && all(lessThan(at, ivec3(n)));
    float open = imageLoad(openness, clamp(at, ivec3(0), ivec3(n - 1)) + ivec3(0, 0, c * n)).a;
    float weight = inside && open > kLpvMinOpen ? w.x * w.y * w.z * open : 0.0;
    best = weight > max_weight ? at : best;
    max_weight = max(max_weight, weight);
  }
  if (max_weight < 1e-3) return;
  int first = 12 * (best.x + n * (best.y + n * (best.z + n * c)));
  for (int k = 0; k < 12; ++k) {
    int part = int(round(light[k / 4][k % 4]));
    if (part != 0) atomicAdd(sums[first + k], part);
  }
}
#endif
