#version 460
#extension GL_GOOGLE_include_directive : require
// The final picture (thesis §5.4.4): camera picture plus change where it shows the real room, virtual radiance where it
// shows an object, mixed by coverage. Pixels that nothing changes keep their code values.
#include "frame.glsl"
#include "srgb.glsl"
#include "tiles.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 1) uniform sampler2D picture;   // code values of the camera
layout(binding = 2) uniform sampler2D radiance;  // the same, linear
layout(binding = 3) uniform sampler2D real_normal;
layout(binding = 4) uniform sampler2D real_albedo;
layout(binding = 5) uniform sampler2D direct_lost;
layout(binding = 6) uniform sampler2D indirect;
layout(binding = 7) uniform sampler2D mirror_gained;
layout(binding = 8) uniform sampler2D mirror_share;
layout(binding = 9) uniform sampler2D object_radiance;
layout(binding = 10) uniform sampler2D object_surface;
layout(binding = 12, rgba8) uniform writeonly image2D out_picture;
layout(binding = 13, rgba16f) uniform writeonly image2D out_delta;

void main() {
  ivec2 at = tile_texel();
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  vec3 b = texelFetch(radiance, at, 0).rgb, delta = vec3(0);
  float coverage = texelFetch(object_surface, at, 0).y;
  float footprint = texelFetch(real_normal, at, 0).a;
  if (footprint > 0.0 && coverage < 0.999) {
    vec4 albedo = texelFetch(real_albedo, at, 0);
    int known = int(albedo.a);
    vec3 change = footprint * texelFetch(indirect, at, 0).rgb - texelFetch(direct_lost, at, 0).rgb;
    vec3 diffuse = albedo.rgb, mirror = vec3(0);
    if (known > 0) {
      Surface s = frame.surfaces[known - 1];
      diffuse = s.base_color_roughness.rgb * (1.0 - s.metallic_specular.x);
      mirror = texelFetch(mirror_gained, at, 0).rgb - b * texelFetch(mirror_share, at, 0).rgb;
    }
    delta = max(diffuse / kPi * change + mirror, -b);
    if (any(isnan(delta)) || any(isinf(delta))) delta = vec3(0);
  }
  vec3 code = texelFetch(picture, at, 0).rgb;
  if (coverage > 0.0 || delta != vec3(0) || frame.camera.z == 0.0) {
    vec3 object = max(texelFetch(object_radiance, at, 0).rgb, vec3(0));
    if (any(isnan(object)) || any(isinf(object))) object = vec3(0);
    code = srgb(frame.camera.y * mix(b + delta, object, coverage));
  }
  imageStore(out_picture, at, vec4(round(code * 255.0) / 255.0, 1.0));
  imageStore(out_delta, at, vec4(delta, coverage));
}
