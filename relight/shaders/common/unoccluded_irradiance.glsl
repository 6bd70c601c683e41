// Irradiance of a real surface with unoccluded lamps and sky. Where the albedo is unknown it follows from the radiance
// b that the camera measured: b = ρ/π E for a Lambert surface.
#ifndef OPEN_LIGHT_GLSL
#define OPEN_LIGHT_GLSL
#include "common/lamp.glsl"

// The lamps, and everything else by nine spherical harmonics (Ramamoorthi & Hanrahan 2001, eq. 3, 7 and 8).
vec3 open_irradiance(vec3 p, vec3 n) {
  vec3 even = kPi * 0.282095 * frame.sh[0].rgb;
  vec3 slope = frame.sh[1].rgb * n.y + frame.sh[2].rgb * n.z + frame.sh[3].rgb * n.x;
  vec3 bend = 1.092548 * (frame.sh[4].rgb * n.x * n.y + frame.sh[5].rgb * n.y * n.z + frame.sh[7].rgb * n.x * n.z) +
              0.315392 * frame.sh[6].rgb * (3.0 * n.z * n.z - 1.0) + 0.546274 * frame.sh[8].rgb * (n.x * n.x - n.y * n.y);
  vec3 e = max(even + 2.0 / 3.0 * kPi * 0.488603 * slope + 0.25 * kPi * bend, vec3(0));
  for (int i = 0; i < frame.counts.x; ++i) {
    vec3 to = frame.lamps[i].position_radius.xyz - p;
    float far2 = dot(to, to);
    vec3 w = to * inversesqrt(far2);
    e += frame.lamps[i].intensity.rgb * (emission(frame.lamps[i], -w) * max(dot(n, w), 0.0) / far2);
  }
  return e;
}

vec3 albedo_by_light(vec3 p, vec3 n, vec3 b) { return clamp(kPi * b / max(open_irradiance(p, n), vec3(1e-6)), 0.0, 1.0); }
#endif
