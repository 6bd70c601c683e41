// The cone operators of the delta radiance field (thesis §5.4.1, eq. 5.18-5.19; delta formalism §3.2-3.4).
//
// One march carries two hidden fractions of the cone: m_v by virtual surfaces, m_r by real ones. The radiance of the
// changed scene is  sum (1 - m_r) dm_v L_virtual + (1 - m_v) dm_r (L_mu + L_delta) + (1 - m_v)(1 - m_r) L_env,  that of
// the real scene the same with m_v = 0. Their difference needs no second march: it is zero until the cone meets
// something virtual; there antiradiance starts (eq. 3.14) and goes on through the real scene alone (eq. 3.15).
//
// Hidden fraction at one place: the part of the cone's disk behind a straight edge at the signed distance d,
// and along the way its greatest value, not the product of all: a silhouette that hides 30 % of the cone at every step
// hides 30 % in all. A product would shut cones that only graze an edge.
#ifndef CONE_GLSL
#define CONE_GLSL
#include "volume.glsl"

const int kMaxSteps = 96;

// Part of a disk behind a straight edge at signed distance x radii from its centre: (acos x - x sqrt(1 - x²)) / π
// within 0.02.
float hidden_fraction(float x) {
  x = clamp(x, -1.0, 1.0);
  return 0.5 - x * (0.75 - 0.25 * x * x);
}

struct Cone {
  vec3 from_real;     // start for looking up real surfaces, moved off them against self-hits
  vec3 from_virtual;  // the same for virtual ones
  vec3 w;
  float tan_half;
};

// The stretch of a ray that the volumes cover, and where it can meet anything virtual.
vec2 known_stretch(Cone k) {
  vec2 box = ray_box(k.from_real, k.w, grid_low(frame.cascade[1]), cascade_high(1));
  return vec2(max(box.x, 0.0), box.y);
}
vec2 virtual_stretch(Cone k) {
  vec3 d = frame.sphere.xyz - k.from_virtual;
  return ray_sphere(k.from_virtual, k.w, frame.sphere.xyz, frame.sphere.w + k.tan_half * length(d));
}

// What the objects bring and take along a cone from a real surface: C_delta but for the real surfaces' own change.
//   gained: radiance of virtual surfaces;  lost: L_mu that they hide;  hidden: the hidden fraction of the real view.
void delta_cone(Cone k, out vec3 gained, out vec3 lost, out float hidden) {
  gained = lost = vec3(0);
  hidden = 0.0;
  vec2 known = known_stretch(k), virt = virtual_stretch(k);
  if (virt.x > virt.y || virt.y <= 0.0) return;
  float m_v = 0.0, m_r = 0.0;
  float least = 0.5 * frame.virtual_grid.w;
  float t = least;
  for (int i = 0; i < kMaxSteps; ++i) {
    if (m_v == 0.0 && t > virt.y) return;
    if (t > known.y && t > virt.y) break;
    float r = max(t * k.tan_half, least);
    float dv = t < virt.y ? virtual_distance(k.from_virtual + t * k.w) : kFar;
    vec3 pr = k.from_real + t * k.w;
    float dr = t < known.y ? (t < known.x ? known.x - t + r : real_distance(pr)) : kFar;
    if (dv < r) {
      float h = hidden_fraction(dv / r);
      if (h > m_v) {
        gained += (1.0 - m_r) * (h - m_v) * virtual_radiance(k.from_virtual + t * k.w, r);
        m_v = h;
      }
    }
    if (dr < r) {
      float h = hidden_fraction(dr / r);
      if (h > m_r) {
        if (m_v > 0.0) lost += m_v * (h - m_r) * real_radiance(pr, r);
        m_r = h;
      }
      if (m_r > 0.995) break;
    }
    t += max(min(dv, dr) - r, max(0.6 * r, least));
  }
  hidden = m_v;
  if (m_v > 0.0 && m_r < 0.995) lost += m_v * (1.0 - m_r) * environment_radiance(k.w, k.tan_half);
}

// The change that real surfaces' own change brings to another real surface: the rest of C_delta.
vec3 change_cone(Cone k) {
  vec3 c = vec3(0);
  vec2 known = known_stretch(k), virt = virtual_stretch(k);
  float m_v = 0.0, m_r = 0.0;
  float least = 0.5 * frame.cascade[0].w;
  float t = max(least, known.x);
  for (int i = 0; i < kMaxSteps && t < known.y; ++i) {
    float r = max(t * k.tan_half, least);
    vec3 pr = k.from_real + t * k.w;
    float dv = t > virt.x && t < virt.y ? virtual_distance(k.from_virtual + t * k.w) : (t < virt.x ? virt.x - t + r : kFar);
    float dr = real_distance(pr);
    if (dv < r) m_v = max(m_v, hidden_fraction(dv / r));
    if (dr < r) {
      float h = hidden_fraction(dr / r);
      if (h > m_r) {
        c += (1.0 - m_v) * (h - m_r) * real_change(pr, r);
        m_r = h;
      }
    }
    if (max(m_r, m_v) > 0.995) break;
    t += max(min(dv, dr) - r, max(0.6 * r, least));
  }
  return c;
}

// C_rho: radiance of the changed scene along a cone.
vec3 rho_cone(Cone k) {
  vec3 c = vec3(0);
  vec2 known = known_stretch(k), virt = virtual_stretch(k);
  float m_v = 0.0, m_r = 0.0;
  float least = 0.5 * frame.virtual_grid.w;
  float t = least;
  for (int i = 0; i < kMaxSteps && (t < known.y || t < virt.y); ++i) {
    float r = max(t * k.tan_half, least);
    vec3 pr = k.from_real + t * k.w, pv = k.from_virtual + t * k.w;
    float dv = t < virt.y ? virtual_distance(pv) : kFar;
    float dr = t < known.y ? real_distance(pr) : kFar;
    if (dv < r) {
      float h = hidden_fraction(dv / r);
      if (h > m_v) {
        c += (1.0 - m_r) * (h - m_v) * virtual_radiance(pv, r);
        m_v = h;
      }
    }
    if (dr < r) {
      float h = hidden_fraction(dr / r);
      if (h > m_r) {
        c += (1.0 - m_v) * (h - m_r) * max(real_radiance(pr, r) + real_change(pr, r), vec3(0));
        m_r = h;
      }
    }
    if (max(m_r, m_v) > 0.995) return c;
    t += max(min(dv, dr) - r, max(0.6 * r, least));
  }
  return c + (1.0 - m_v) * (1.0 - m_r) * environment_radiance(k.w, k.tan_half);
}

// C_mu: radiance of the real scene along a cone.
vec3 mu_cone(Cone k) {
  vec3 c = vec3(0);
  vec2 known = known_stretch(k);
  float m_r = 0.0, least = 0.5 * frame.cascade[0].w;
  float t = max(least, known.x);
  for (int i = 0; i < kMaxSteps && t < known.y; ++i) {
    float r = max(t * k.tan_half, least);
    vec3 p = k.from_real + t * k.w;
    float d = real_distance(p);
    if (d < r) {
      float h = hidden_fraction(d / r);
      if (h > m_r) {
        c += (h - m_r) * real_radiance(p, r);
        m_r = h;
      }
      if (m_r > 0.995) return c;
    }
    t += max(d - r, max(0.6 * r, least));
  }
  return c + (1.0 - m_r) * environment_radiance(k.w, k.tan_half);
}

// Shadow cone C_s (eq. 5.20): what is left of a narrow cone over a stretch, by real and by virtual surfaces.
vec2 shadow_cone(Cone k, float t_far) {
  vec2 known = known_stretch(k), virt = virtual_stretch(k);
  float m_v = 0.0, m_r = 0.0;
  float least = 0.5 * frame.virtual_grid.w;
  float t = least;
  t_far = min(t_far, max(known.y, virt.y));
  for (int i = 0; i < kMaxSteps && t < t_far; ++i) {
    float r = max(t * k.tan_half, least);
    float dv = t < virt.y ? virtual_distance(k.from_virtual + t * k.w) : kFar;
    float dr = t < known.y ? (t < known.x ? known.x - t + r : real_distance(k.from_real + t * k.w)) : kFar;
    m_v = max(m_v, hidden_fraction(dv / r));
    m_r = max(m_r, hidden_fraction(dr / r));
    if (m_r > 0.995) break;
    t += max(min(dv, dr) - r, max(0.6 * r, least));
  }
  return 1.0 - vec2(m_r, m_v);
}
#endif
