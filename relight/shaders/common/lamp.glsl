// Samples lamps as discs of points, each with a fraction of the lamp's solid angle.
#ifndef LAMP_GLSL
#define LAMP_GLSL
#include "common/frame.glsl"

// A sample's cone is narrower than its part of the disc: a thin wall would not cover a wider one, and neighbouring
// cones still overlap.
const float kLampConeScale = 0.75;

struct LampSample {
  vec3 w;          // unit, towards the lamp
  float distance;  // m
  float tan_half;  // aperture of this sample's cone
  vec3 irradiance; // W/m² on a plane perpendicular to w
};

// Radiant intensity along w, leaving the lamp, over the lamp's `intensity`: a flat lamp is a Lambert emitter.
float emission(Lamp lamp, vec3 w) {
  return lamp.facing.a > 0.0 ? lamp.facing.a * max(dot(lamp.facing.xyz, w), 0.0) : 1.0;
}

// Point i of n on a disc of radius 1: a sunflower spiral (Vogel 1979) of antipodal pairs, each rotated by 0.618 of
// a half turn from the previous, so that the mean of even a few points is the centre, which grazing light requires.
vec2 disc_point(int i, int n) {
  int odd = n & 1, pair = (i - odd) / 2;
  if (i < odd) return vec2(0);
  float r = sqrt(float(2 * pair + 1 + odd) / float(n)), phi = kPi * (0.618034 * float(pair) + float((i - odd) & 1));
  return r * vec2(cos(phi), sin(phi));
}

// Sample i of n of a lamp seen from p: a point on its disc, which faces p unless the lamp is flat.
LampSample lamp_sample(Lamp lamp, vec3 p, int i, int n) {
  vec3 to = lamp.position_radius.xyz - p;
  float far = length(to);
  vec3 axis = to / far, x, y;
  basis(lamp.facing.a > 0.0 ? lamp.facing.xyz : axis, x, y);
  float radius = min(lamp.position_radius.w, 0.9 * far);
  vec2 q = radius * disc_point(i, n);
  vec3 at = to + q.x * x + q.y * y;
  LampSample s;
  s.distance = length(at);
  s.w = at / s.distance;
  s.tan_half = min(kLampConeScale / sqrt(float(n)), 0.3) * radius / far;
  s.irradiance = lamp.intensity.rgb * emission(lamp, -s.w) / (float(n) * s.distance * s.distance);
  return s;
}
#endif
