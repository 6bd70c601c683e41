// Where the camera clips a channel, its radiance is a lower bound (Tobin 1958). b: radiance of a pixel.
#ifndef CLIPPED_GLSL
#define CLIPPED_GLSL

// Within half a step of 8 bits of the top of the range.
bvec3 clipped(vec3 b) { return greaterThan(b * frame.exposure.rgb, vec3(0.998)); }

// `by_light`: what albedo and light give.
vec3 restored(vec3 b, vec3 by_light) { return mix(b, max(b, by_light), clipped(b)); }

// The image's detail over the fused mean; a bound does not lower it.
vec3 image_detail(vec3 b, vec3 mean) {
  vec3 detail = clamp(b / max(mean, vec3(1e-5)), vec3(0.2), vec3(4.0));
  return mix(detail, max(detail, vec3(1)), clipped(b));
}
#endif
