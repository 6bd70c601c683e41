// Change of irradiance at a real surface (thesis eq. 5.16), looked up half a cell in front of it.
#ifndef LPV_QUERY_GLSL
#define LPV_QUERY_GLSL
#include "volume/volume.glsl"
#include "lpv/lpv.glsl"
layout(binding = 7) uniform sampler3D light_red;  // Φ, J
layout(binding = 8) uniform sampler3D light_green;
layout(binding = 9) uniform sampler3D light_blue;
layout(binding = 10) uniform sampler3D openness;  // a: open part of the volume

// Width in cells of the border over which a cascade fades to the next, and the last one to zero.
const float kLpvFade = 2.0;
float lpv_inside(int c, vec3 p) {
  vec3 g = lpv_place(c, p), from_border = min(g, float(frame.pass_i.x) - g);
  return clamp((min(min(from_border.x, from_border.y), from_border.z) - 0.5) / kLpvFade, 0.0, 1.0);
}

// Solid cells hold no light, so the mean is weighted by the cells' open parts.
vec3 lpv_irradiance(int c, vec3 p, vec3 n) {
  float cells = float(frame.pass_i.x), cell = lpv_cell_m(c);
  vec3 g = clamp(lpv_place(c, p) + kLpvShift * n, vec3(0.5), vec3(cells - 0.5));
  vec3 uvw = (g + vec3(0.0, 0.0, float(c) * cells)) / (cells * vec3(1.0, 1.0, float(kCascades)));
  vec4 weight = vec4(kLpvEven, -kLpvDirected * n);
  vec3 e = vec3(dot(weight, textureLod(light_red, uvw, 0.0)), dot(weight, textureLod(light_green, uvw, 0.0)),
                dot(weight, textureLod(light_blue, uvw, 0.0)));
  return e / (max(textureLod(openness, uvw, 0.0).a, kLpvMinOpen) * cell * cell);
}

vec3 lpv_irradiance(vec3 p, vec3 n) {
  float inner = lpv_inside(0, p), outer = (1.0 - inner) * lpv_inside(1, p);
  vec3 e = vec3(0);
  for (int c = inner > 0.0 ? 0 : 1; c < (outer > 0.0 ? 2 : 1); ++c) e += (c == 0 ? inner : outer) * lpv_irradiance(c, p, n);
  return e;
}
#endif
