// Material and shading normal of a virtual surface: factors, vertex colour, textures. Same as objects/model_surface.h, but
// that the roughness of a normal map is interpolated between mip levels by its square root, and that sheen and anisotropy
// are what a base colour and a roughness can be. For fragment shaders alone.
#include "common/interop.h"
layout(std140, binding = 0) uniform Draw { DrawParams draw; };
layout(binding = 1) uniform sampler2D base_color_texture;          // linear
layout(binding = 3) uniform sampler2D metallic_roughness_texture;  // roughness in g, metallic in b
layout(binding = 4) uniform sampler2D normal_texture;  // tangent frame, each component from -1 to 1; a: upload_model.h
layout(binding = 5) uniform sampler2D emissive_texture;      // linear
layout(binding = 6) uniform sampler2D transmission_texture;  // in r
layout(binding = 7) uniform sampler2D clearcoat_texture;     // in r
layout(binding = 8) uniform sampler2D clearcoat_roughness_texture;  // in g

// TextureUse of objects/texture.h
const int kBaseColor = 0, kMetallicRoughness = 1, kNormals = 2, kEmission = 3, kTransmission = 4, kClearcoat = 5,
          kClearcoatRoughness = 6;

// The tent of bilinear interpolation adds twice the variance of a texel's square.
const float kSquareOverTent = 1.7320508;

vec4 texture_mean(sampler2D of, vec2 uv, vec2 uv_right, vec2 uv_down) {
  return textureGrad(of, uv, uv_right / kSquareOverTent, uv_down / kSquareOverTent);
}
vec4 texture_mean(sampler2D of, vec2 uv) { return texture_mean(of, uv, dFdx(uv), dFdy(uv)); }

// The mean over what a sample shows, as Texture::mean of objects/texture.h.
const float kTexelsOfWidth = 2.0, kTexelsOfLength = 32.0, kTapsPerTexel = 2.0;
vec4 cell_mean(sampler2D of, vec2 uv) {
  vec2 uv_long = dFdx(uv), uv_short = dFdy(uv), size = vec2(textureSize(of, 0));
  float longer = length(size * uv_long), shorter = length(size * uv_short);
  if (shorter > longer) {
    vec3 other = vec3(uv_long, longer);
    uv_long = uv_short;
    longer = shorter;
    uv_short = other.xy;
    shorter = other.z;
  }
  float width = abs(determinant(mat2(size * uv_long, size * uv_short))) / max(longer, 1e-30);
  float level = floor(log2(max(1.0, max(width / kTexelsOfWidth, longer / kTexelsOfLength))));
  float taps_per_texel = kTapsPerTexel * exp2(-level);
  float columns = clamp(ceil(taps_per_texel * longer), 1.0, kTapsPerTexel * kTexelsOfLength),
        rows = clamp(ceil(taps_per_texel * shorter), 1.0, ceil(max(taps_per_texel * width, kTapsPerTexel * kTexelsOfWidth)));
  vec4 sum = vec4(0);
  for (float y = 0.5; y < rows; ++y) {
    for (float x = 0.5; x < columns; ++x)
      sum += textureLod(of, uv + (x / columns - 0.5) * uv_long + (y / rows - 0.5) * uv_short, level);
  }
  return sum / (columns * rows);
}

// `uv`: both sets of texture coordinates, here and below.
vec2 texture_uv(int use, vec4 uv) {
  vec4 row = draw.texture_rows[2 * use];
  vec3 of_set = vec3(row.w > 0.0 ? uv.zw : uv.xy, 1.0);
  return vec2(dot(row.xyz, of_set), dot(draw.texture_rows[2 * use + 1].xyz, of_set));
}

bool has_texture(int use) { return draw.texture_rows[2 * use + 1].w > 0.0; }

// Fraction of the light under the layer that passes the surface.
float surface_transmission(vec4 uv) {
  float factor = draw.tint.z;
  return has_texture(kTransmission) ? factor * texture_mean(transmission_texture, texture_uv(kTransmission, uv)).r : factor;
}

// Intensity and roughness.
vec2 surface_coat(vec4 uv) {
  vec2 coat = draw.coat.xy;
  if (has_texture(kClearcoat)) coat.x *= texture_mean(clearcoat_texture, texture_uv(kClearcoat, uv)).r;
  if (has_texture(kClearcoatRoughness))
    coat.y *= texture_mean(clearcoat_roughness_texture, texture_uv(kClearcoatRoughness, uv)).g;
  return coat;
}

vec3 surface_color(vec4 uv, vec3 tint) {
  vec3 base = draw.base_color.rgb * mix(vec3(1), tint, draw.tint.x);
  if (draw.base_color.a > 0.0) base *= cell_mean(base_color_texture, texture_uv(kBaseColor, uv)).rgb;
  return base * draw.sheen.a + draw.sheen.rgb;
}

// Radiance that a camera sees of a side of the surface besides reflected light, W/sr/m². `tint`: colour
// of the vertices.
bool is_unlit() { return draw.tint.w > 0.0; }
vec3 surface_emission(bool front, vec4 uv, vec3 tint) {
  if (is_unlit()) return draw.tint.w * surface_color(uv, tint);
  vec3 emission = draw.emission.rgb;
  if (draw.emission.a > 0.0) {
    emission *= cell_mean(emissive_texture, texture_uv(kEmission, uv)).rgb;
  }
  return front ? emission : vec3(0);
}

vec2 surface_roughness_metallic(vec4 uv) {
  vec2 both = draw.material.xy;
  if (draw.maps.x + draw.maps.y > 0.0) {
    both *= mix(vec2(1), texture_mean(metallic_roughness_texture, texture_uv(kMetallicRoughness, uv)).gb, draw.maps.xy);
  }
  if (draw.maps.z != 0.0) {
    float root = texture_mean(normal_texture, texture_uv(kNormals, uv)).a * draw.maps.z, alpha = both.x * both.x;
    both.x = min(sqrt(sqrt(alpha * alpha + 2.0 * root * root)), 1.0);
  }
  if (draw.coat.z > 0.0) {
    // In place of an anisotropic lobe an isotropic one of the same mean slope variance, which is masked as much.
    float across = both.x * both.x, along = mix(across, 1.0, draw.coat.z);
    both.x = sqrt(sqrt(0.5 * (across * across + along * along)));
  }
  return both;
}

// Directions of x and y of the normal map by the triangle's texture coordinates, perpendicular to n; false where these
// have no area.
bool triangle_tangents(vec3 n, vec3 world, vec2 uv, out vec3 x, out vec3 y) {
  vec3 right = dFdx(world), down = dFdy(world);
  vec2 uv_right = dFdx(uv), uv_down = dFdy(uv);
  float area = uv_right.x * uv_down.y - uv_down.x * uv_right.y;
  // Equal texture coordinates are interpolated with rounding errors.
  if (abs(area) <= 1e-12 * max(dot(uv, uv), 1e-6)) return false;
  vec3 along_u = (right * uv_down.y - down * uv_right.y) / area,
       along_v = (down * uv_right.x - right * uv_down.x) / area;
  x = along_u - dot(n, along_u) * n;
  if (!(dot(x, x) > 0.0)) return false;
  x = normalize(x);
  y = cross(n, x);
  if (dot(y, along_v) > 0.0) y = -y;
  return true;
}

// `n`: unit, interpolated. `tangent`: that of the vertices, interpolated, its handedness in a; zero: none.
vec3 surface_normal(vec3 n, vec3 world, vec4 uv, vec4 tangent) {
  if (draw.maps.z == 0.0) return n;
  vec2 at = texture_uv(kNormals, uv);
  vec3 map = 2.0 * texture_mean(normal_texture, at).rgb - 1.0;
  vec3 x, y;
  bool known = triangle_tangents(n, world, at, x, y);
  vec3 along = tangent.xyz - dot(n, tangent.xyz) * n;
  if (dot(along, along) > 1e-6) {
    x = normalize(along);
    y = (tangent.w < 0.0 ? -1.0 : 1.0) * cross(n, x);
    known = true;
  }
  return known ? normalize(draw.maps.z * (map.x * x + map.y * y) + map.z * n) : n;
}
