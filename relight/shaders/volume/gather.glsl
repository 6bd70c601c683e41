// Sums of cones over a hemisphere. Weights are normalised, so uniform radiance L gives the irradiance π L exactly.
#ifndef GATHER_GLSL
#define GATHER_GLSL
#include "volume/cone.glsl"

// Cone i of count, cosine distributed (golden-angle spiral). Its width is its fraction of the hemisphere times a factor
// that keeps thin geometry from appearing solid; cones never extend below the horizon.
const float kConeScale = 0.6;
Cone hemisphere_cone(vec3 from_real, vec3 from_virtual, vec3 n, int i, int count, float turn) {
  vec3 x, y;
  basis(n, x, y);
  float s2 = (float(i) + 0.5) / float(count), s = sqrt(s2), c = sqrt(1.0 - s2);
  float phi = 2.39996323 * float(i) + 2.0 * kPi * turn;
  Cone k;
  k.from_real = from_real;
  k.from_virtual = from_virtual;
  k.w = s * (cos(phi) * x + sin(phi) * y) + c * n;
  k.tan_half = min(kConeScale * sqrt(2.0 / float(count)), 0.8 * c);
  return k;
}

// Irradiance of the changed scene.
vec3 gather_rho(vec3 from_real, vec3 from_virtual, vec3 n, int count, float turn) {
  vec3 e = vec3(0);
  for (int i = 0; i < count; ++i) e += rho_cone(hemisphere_cone(from_real, from_virtual, n, i, count, turn));
  return e * (kPi / float(count));
}

// Irradiance of the real scene.
vec3 gather_mu(vec3 from_real, vec3 from_virtual, vec3 n, int count, float turn) {
  vec3 e = vec3(0);
  for (int i = 0; i < count; ++i) e += mu_cone(hemisphere_cone(from_real, from_virtual, n, i, count, turn));
  return e * (kPi / float(count));
}

// Change of irradiance at a real surface by the change of other real surfaces; beyond: the enclosure's part of it.
vec3 gather_change(vec3 from_real, vec3 from_virtual, vec3 n, int count, float turn, out vec3 beyond) {
  vec3 e = vec3(0), b;
  beyond = vec3(0);
  for (int i = 0; i < count; ++i) {
    e += change_cone(hemisphere_cone(from_real, from_virtual, n, i, count, turn), b);
    beyond += b;
  }
  beyond *= kPi / float(count);
  return e * (kPi / float(count)) + beyond;
}
vec3 gather_change(vec3 from_real, vec3 from_virtual, vec3 n, int count, float turn) {
  vec3 beyond;
  return gather_change(from_real, from_virtual, n, count, turn, beyond);
}

// Change of irradiance at a real surface by virtual surfaces: cones aimed at the sphere around them, as light can
// change only in these directions. Near and inside the sphere the cap widens to all of it.
void gather_delta(vec3 p, vec3 from_real, vec3 n, int cones, float turn, out vec3 gained, out vec3 lost) {
  gained = lost = vec3(0);
  vec3 to = frame.sphere.xyz - p;
  float far = max(length(to), 1e-4), q = frame.sphere.w / far;
  vec3 axis = to / far, x, y;
  float cos_max = q < 1.0 ? sqrt(1.0 - q * q) : -clamp(1.0 - 1.0 / q, 0.0, 1.0);
  float cap = 1.0 - cos_max;  // solid angle / 2π
  int count = clamp(int(float(cones) * sqrt(cap) + 0.5), min(cones, 6), 2 * cones);
  basis(axis, x, y);
  float max_tan_half = kConeScale * sqrt(2.0 * cap / float(count));
  for (int i = 0; i < count; ++i) {
    float c = 1.0 - cap * (float(i) + 0.5) / float(count), s = sqrt(max(1.0 - c * c, 0.0));
    float phi = 2.39996323 * float(i) + 2.0 * kPi * turn;
    Cone k;
    k.w = s * (cos(phi) * x + sin(phi) * y) + c * axis;
    float cosine = dot(n, k.w);
    if (cosine <= 0.01) continue;
    k.from_real = from_real;
    k.from_virtual = p;
    k.tan_half = min(max_tan_half, 0.8 * cosine);
    vec3 g, l;
    float hidden;
    delta_cone(k, g, l, hidden);
    gained += cosine * g;
    lost += cosine * l;
  }
  float each = 2.0 * kPi * cap / float(count);
  gained *= each;
  lost *= each;
}
#endif
