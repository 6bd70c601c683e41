#version 460
#extension GL_GOOGLE_include_directive : require
// The final picture where indirect light alone changes: the camera picture times the gain of gain.comp.
#include "frame.glsl"
#include "srgb.glsl"
#include "tiles.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 1) uniform sampler2D picture;   // code values of the camera
layout(binding = 2) uniform sampler2D radiance;  // the same, linear
layout(binding = 3) uniform sampler2D gain;
layout(binding = 12, rgba8) uniform writeonly image2D out_picture;

void main() {
  ivec2 at = tile_texel();
  if (any(greaterThanEqual(at, frame.picture.xy))) return;
  vec3 k = texelFetch(gain, at / frame.pass_i.x, 0).rgb, code = texelFetch(picture, at, 0).rgb;
  if (k != vec3(1) || frame.camera.z == 0.0) code = srgb(frame.camera.y * k * texelFetch(radiance, at, 0).rgb);
  imageStore(out_picture, at, vec4(round(code * 255.0) / 255.0, 1.0));
}
