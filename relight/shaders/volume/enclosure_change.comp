#version 460
#extension GL_GOOGLE_include_directive : require
// Change of the light that the enclosure reflects (thesis eq. 3.13), gathered from the current volumes and enclosure.
// pass_i.x: cones over the hemisphere.
#include "volume/enclosure.glsl"
#include "common/half.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 12) uniform sampler2D enclosure_response;
layout(binding = 13) uniform sampler2D enclosure_lost;
layout(binding = 18, rgba16f) uniform writeonly image2D out_change;

void main() {
  ivec2 at = ivec2(gl_GlobalInvocationID.xy), size = imageSize(out_change);
  if (any(greaterThanEqual(at, size))) return;
  vec3 p, n, change = vec3(0), response = texelFetch(enclosure_response, at, 0).rgb;
  if (enclosure_point(at, size, p, n) && response != vec3(0)) {
    vec3 off = p + frame.cascade[0].w * n, gained, taken;
    float turn = pixel_turn(at);
    gather_delta(p, off, n, frame.counts.y, turn, gained, taken);
    change = response * (gained - taken - texelFetch(enclosure_lost, at, 0).rgb +
                         gather_change(off, p, n, frame.pass_i.x, turn));
  }
  imageStore(out_change, at, to_half(vec4(change, 1.0)));
}
