#version 460
#extension GL_GOOGLE_include_directive : require
// What compose/composer.h blends to the final frame (thesis §5.4.4): the change of radiance of real pixels, and the
// objects' radiance.
#include "common/frame.glsl"
#include "common/brdf.glsl"
#include "common/finite.glsl"
#include "common/half.glsl"
#include "common/tiles.glsl"
#include "common/material_mask.glsl"

const float kUnlike = 0.5;  // dissimilarity of surfaces: normals differ by 60°, or depth by 2.5 %
layout(binding = 1) uniform sampler2D real_position;
layout(binding = 2) uniform sampler2D radiance;  // of the camera
layout(binding = 3) uniform sampler2D real_normal;
layout(binding = 4) uniform sampler2D real_albedo;
layout(binding = 5) uniform sampler2D direct_lost;
layout(binding = 6) uniform sampler2D indirect;
layout(binding = 7) uniform sampler2D mirror_gained;
layout(binding = 8) uniform sampler2D mirror_fraction;
layout(binding = 9) uniform sampler2D object_radiance;
layout(binding = 10) uniform sampler2D object_surface;
layout(binding = 14) uniform sampler2D object_normal;
layout(binding = 15) uniform sampler2D object_other;
layout(binding = 12, rgba16f) uniform writeonly image2D out_object;  // radiance times coverage, coverage
layout(binding = 13, rgba32f) uniform writeonly image2D out_delta;
layout(binding = 16, r32f) uniform writeonly image2D out_z;          // of the object in the camera frame
layout(binding = 17, rgba16f) uniform writeonly image2D out_room;    // radiance of the room, clipped channels restored
#include "common/exclude_tag.glsl"
#include "screen/real_in_front.glsl"
#include "common/unoccluded_irradiance.glsl"
#include "screen/clipped.glsl"

vec3 lit(ivec2 at) { return max(finite_or_zero(texelFetch(object_radiance, at, 0).rgb), vec3(0)); }

// At an edge between two virtual surfaces each pixel is shaded for one of them only; the other's part takes the colour
// of the most similar neighbouring pixel.
vec3 virtual_color(ivec2 at) {
  vec3 own = lit(at);
  float other_fraction = texelFetch(object_surface, at, 0).w;
  if (other_fraction == 0.0) return own;
  vec4 other = texelFetch(object_other, at, 0);
  float min_unlike = kUnlike;
  vec3 mixed = own;
  for (int i = 0; i < 9; ++i) {
    ivec2 q = clamp(at + ivec2(i % 3, i / 3) - 1, ivec2(0), frame.picture.xy - 1);
    vec4 surface = texelFetch(object_surface, q, 0);
    float unlike = 20.0 * abs(surface.x - other.w) / max(other.w, 1e-3) + 1.0 -
                   dot(texelFetch(object_normal, q, 0).xyz, other.xyz);
    if (i == 4 || surface.y == 0.0 || unlike >= min_unlike) continue;
    min_unlike = unlike;
    mixed = mix(own, lit(q), other_fraction);
  }
  return mixed;
}

void main() {
  ivec2 at = tile_texel();
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  vec3 b = texelFetch(radiance, at, 0).rgb, room = b, delta = vec3(0);
  vec4 surface = texelFetch(object_surface, at, 0);
  float footprint = texelFetch(real_normal, at, 0).a;
  if (footprint > 0.0 && shows_room(surface, texelFetch(real_position, at, 0).a)) {
    vec4 albedo = texelFetch(real_albedo, at, 0);
    int known = int(albedo.a);
    vec3 diffuse = albedo.rgb, under = vec3(1), mirror = vec3(0);
    if (known == 0 && any(clipped(b))) {
      vec3 light = open_irradiance(texelFetch(real_position, at, 0).xyz, texelFetch(real_normal, at, 0).xyz);
      room = restored(b, diffuse / kPi * light);
    }
    if (known > 0) {
      float paper = paper_coverage(albedo.a);
      BsdfParams bsdf = bsdf_of(frame.surfaces[known - 1]);
      diffuse = mix(bsdf.diffuse, albedo.rgb, paper);
      under = mix(through_evenly(bsdf) * through_evenly(bsdf), vec3(1), paper);
      mirror = (1.0 - paper) * (texelFetch(mirror_gained, at, 0).rgb -
                                exclude_tag(at, b, albedo.a) * texelFetch(mirror_fraction, at, 0).rgb);
    }
    // The lost light of lamps already includes the layer's transmittance.
    vec3 change = footprint * under * texelFetch(indirect, at, 0).rgb - texelFetch(direct_lost, at, 0).rgb;
    delta = max(finite_or_zero(diffuse / kPi * change + mirror), -room);
  }
  imageStore(out_delta, at, vec4(delta, 0.0));
  imageStore(out_room, at, to_half(vec4(room, 0.0)));
  imageStore(out_object, at, to_half(vec4(surface.y * virtual_color(at), surface.y)));
  imageStore(out_z, at, vec4(surface.x));
}
