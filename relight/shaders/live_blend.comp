#version 460
#extension GL_GOOGLE_include_directive : require
// The same as live_object.comp where the objects' radiance depends on the view and was found pixel by pixel.
#include "live_change.glsl"
#include "tiles.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 11) uniform sampler2D object_radiance;
layout(binding = 13) uniform sampler2D object_surface;  // y: coverage
layout(binding = 12, rgba8) uniform writeonly image2D out_picture;

void main() {
  ivec2 at = tile_texel();
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  vec3 code = texelFetch(codes, at, 0).rgb, gain = live_gain(live_real(at, code));
  float share = texelFetch(object_surface, at, 0).y;
  if (share > 0.0 || gain != vec3(1)) {
    vec3 object = max(texelFetch(object_radiance, at, 0).rgb, vec3(0));
    if (any(isnan(object)) || any(isinf(object))) object = vec3(0);
    code = srgb(mix(gain * srgb_linear(code), frame.camera.y * object, share));
  }
  imageStore(out_picture, at, vec4(round(code * 255.0) / 255.0, 1.0));
}
