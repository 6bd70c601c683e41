// Which of the real and the virtual surfaces of a pixel is in front. Depths are along z; real: negative or 0 hides nothing.
#ifndef REAL_IN_FRONT_GLSL
#define REAL_IN_FRONT_GLSL
#include "common/frame.glsl"

// Contact tolerance: an object standing on a real surface must not be cut by that surface's depth error.
bool real_in_front(float real, float object) {
  return real > 0.0 && object > real + max(0.3 * frame.field.x, 0.003 * real);
}

// Whether an object's sample is hidden here. Where the measured depth (0: none) is clearly before or behind it, fused
// surfaces do not decide: what is before it hides it later, by a matte (compose/foreground_matte.h). ray: x/z, y/z.
bool hides(float real, float measured, float object, vec2 ray) {
  float per_z = length(vec3(ray, 1.0)), t = per_z * measured;
  float allowed = dot(frame.depth_noise.xyz, vec3(1.0, t, t * t)) + frame.field.x;
  bool differs = measured > 0.0 && per_z * abs(object - measured) > allowed;
  return !differs && real_in_front(real, object);
}

// Whether the picture may show the room. surface: as in object_surface.
bool shows_room(vec4 surface, float real) { return surface.y < 0.999 || real_in_front(real, surface.x); }
#endif
