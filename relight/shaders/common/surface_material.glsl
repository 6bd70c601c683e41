// Material and shading normal of a virtual surface: factors, vertex colour, textures. Same as objects/model_surface.h, but
// that the roughness of a normal map is interpolated between mip levels by its square root. For fragment shaders alone.
#include "common/interop.h"
#include "common/srgb.glsl"
layout(std140, binding = 0) uniform Draw { DrawParams draw; };
layout(binding = 1) uniform sampler2D base_color_texture;          // 8-bit sRGB
layout(binding = 3) uniform sampler2D metallic_roughness_texture;  // roughness in g, metallic in b
layout(binding = 4) uniform sampler2D normal_texture;  // tangent frame, each component from -1 to 1; a: upload_model.h

// The tent of bilinear interpolation adds twice the variance of a texel's square.
const float kSquareOverTent = 1.7320508;

vec4 texture_mean(sampler2D of, vec2 uv, vec2 uv_right, vec2 uv_down) {
  return textureGrad(of, uv, uv_right / kSquareOverTent, uv_down / kSquareOverTent);
}
vec4 texture_mean(sampler2D of, vec2 uv) { return texture_mean(of, uv, dFdx(uv), dFdy(uv)); }

vec3 surface_color(vec2 uv, vec3 tint) {
  vec3 base = draw.base_color.rgb * mix(vec3(1), tint, draw.tint.x);
  if (draw.base_color.a > 0.0) base *= srgb_decode(texture_mean(base_color_texture, uv).rgb);
  return base;
}

vec2 surface_roughness_metallic(vec2 uv) {
  vec2 both = draw.material.xy;
  if (draw.maps.x + draw.maps.y > 0.0) {
    both *= mix(vec2(1), texture_mean(metallic_roughness_texture, uv).gb, draw.maps.xy);
  }
  if (draw.maps.z != 0.0) {
    float root = texture_mean(normal_texture, uv).a * draw.maps.z, alpha = both.x * both.x;
    both.x = min(sqrt(sqrt(alpha * alpha + 2.0 * root * root)), 1.0);
  }
  return both;
}

// `n`: unit, interpolated. The tangent frame is that of the triangle.
vec3 surface_normal(vec3 n, vec3 world, vec2 uv) {
  if (draw.maps.z == 0.0) return n;
  vec3 right = dFdx(world), down = dFdy(world);
  vec2 uv_right = dFdx(uv), uv_down = dFdy(uv);
  float area = uv_right.x * uv_down.y - uv_down.x * uv_right.y;
  // Equal texture coordinates are interpolated with rounding errors.
  if (abs(area) <= 1e-12 * max(dot(uv, uv), 1e-6)) return n;
  vec3 along_u = (right * uv_down.y - down * uv_right.y) / area,
       along_v = (down * uv_right.x - right * uv_down.x) / area;
  vec3 x = along_u - dot(n, along_u) * n;
  if (!(dot(x, x) > 0.0)) return n;
  x = normalize(x);
  vec3 y = cross(n, x);
  if (dot(y, along_v) > 0.0) y = -y;
  vec3 map = 2.0 * texture_mean(normal_texture, uv, uv_right, uv_down).rgb - 1.0;
  return normalize(draw.maps.z * (map.x * x + map.y * y) + map.z * n);
}

// Radiance that leaves a side of the surface, W/sr/m².
vec3 surface_emission(bool front) { return front ? draw.emission.rgb : vec3(0); }
