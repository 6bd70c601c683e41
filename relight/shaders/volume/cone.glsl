// The cone operators of the delta radiance field (thesis §5.4.1, eq. 5.18-5.19; delta formalism §3.2-3.4).
//
// One march carries two occluded fractions of the cone: m_v by virtual surfaces, m_r by real ones. The radiance of the
// changed scene is
//
//   sum (1 - m_r) dm_v L_virtual + (1 - m_v) dm_r (L_mu + L_delta) + (1 - m_v)(1 - m_r) L_env,
//
// that of the real scene is the same with m_v = 0. Their difference needs no second march: it is zero until the cone
// hits a virtual surface; from there on antiradiance (eq. 3.14) continues through the real scene only (eq. 3.15).
//
// The occluded fraction at a point is the part of the cone's disk behind a straight edge at the signed distance d;
// along the cone it is the maximum, not the product: a silhouette that covers 30 % of the cone at every step covers 30
// % in total. A product would close cones that only graze an edge.
//
// The march looks up distances only; radiance is looked up once, at the step with the largest increase of occlusion.
// (Software devices execute every branch of every step.)
#ifndef CONE_GLSL
#define CONE_GLSL
#include "volume/volume.glsl"
#include "volume/mirror.glsl"

const int kMaxSteps = 64;

// Part of a disk behind a straight edge at signed distance x radii from its centre: (acos x - x sqrt(1 - x²)) / π,
// accurate to 0.02 while the axis is unoccluded. Once the axis is occluded the rest closes twice as fast: a wall half
// as thick as the cone is wide would otherwise leak light.
float hidden_fraction(float x) {
  x = clamp(x < 0.0 ? 2.0 * x : x, -1.0, 1.0);
  return 0.5 - x * (0.75 - 0.25 * x * x);
}

// Distances are measured from the axis, so a step of most of the distance is free except for the cone's rim; near
// surfaces a third of the radius resolves the deepest point of a wall as thin as the cone.
float next_step(float d, float r, float min_m) { return max(max(0.75 * abs(d), 0.35 * r), min_m); }

// State of the march past virtual surfaces. These may be sheets thinner than the cone is wide, whose inside gives no
// distance to their edge: if the axis hits one the cone is fully occluded, whatever is left of the disk; before that
// the disk closes over a shorter distance, so that edges occlude little more than they should. Sheets thinner than a
// voxel have no inside: a wide cone whose axis approaches a surface (the distance falls by more than half of the step)
// has hit it within kSkin, the maximum interpolated distance to a sheet between two voxels. For narrow cones this would
// thicken thin parts, so they use kNarrowSkin.
const float kClosing = 2.0;
const float kSkin = 0.55, kNarrowSkin = 0.3;  // voxels
struct Past {
  float d, t, fall;  // at the previous point
};
float virtual_hidden(inout Past past, float d, float t, float reach) {
  float fall = (past.d - d) / max(t - past.t, 1e-6);
  past = Past(d, t, fall);
  float voxel = frame.virtual_grid.w, skin = voxel * clamp(kSkin * reach / voxel, kNarrowSkin, kSkin);
  bool met = d < 0.0 || (d < skin && fall > 0.5);
  return met ? 1.0 : hidden_fraction(kClosing * d / reach);
}
// An axis that approaches a virtual surface takes small steps, or it could cross a sheet without sampling its inside.
float careful_step(Past past, float d, float r, float min_m) {
  return max(max(0.75 * abs(d), (past.fall > 0.3 && past.d < r ? 0.12 : 0.35) * r), min_m);
}

struct Cone {
  vec3 from_real;     // origin for look-ups of real surfaces, offset from them against self-intersection
  vec3 from_virtual;  // the same for virtual ones
  vec3 w;
  float tan_half;
};

// From a point on a real surface; direction and aperture are to be set.
Cone cone_from_real(vec3 p, vec3 n) {
  Cone k;
  k.from_virtual = p;
  k.from_real = p + cone_start_m() * n;
  return k;
}

// Position for look-ups of real surfaces: the origin's offset decreases to zero over eight times its length, otherwise
// everything would appear shifted by it.
vec3 real_place(Cone k, float t) {
  vec3 off = k.from_real - k.from_virtual;
  return k.from_virtual + max(1.0 - t / (8.0 * length(off) + 1e-6), 0.0) * off + t * k.w;
}

// The interval of a ray inside the volumes, and the interval that may contain virtual surfaces.
vec2 known_stretch(Cone k) {
  vec2 box = ray_box(k.from_real, k.w, grid_low(frame.cascade[1]), cascade_high(1));
  return vec2(max(box.x, 0.0), box.y);
}
vec2 virtual_stretch(Cone k) {
  vec3 d = frame.sphere.xyz - k.from_virtual;
  return ray_sphere(k.from_virtual, k.w, frame.sphere.xyz, frame.sphere.w + k.tan_half * length(d));
}

// One kind of surface along a cone: its occlusion, its accumulated weight, and the position of the largest increase.
struct Layer {
  float hidden, seen, max_weight, at;
};
void add_hit(inout Layer layer, float h, float open, float t) {
  float more = max(h - layer.hidden, 0.0), weight = open * more;
  layer.hidden += more;
  layer.seen += weight;
  layer.at = weight > layer.max_weight ? t : layer.at;
  layer.max_weight = max(layer.max_weight, weight);
}

float reach_of(Cone k, float t, float min_m) { return max(t * k.tan_half, min_m); }

// From real surfaces objects are looked up as a whole, from each other one side at a time (virtual_radiance()).
const float kFocusFar = 0.25, kFocusNear = 0.5;

// L_mu of the surface that a cone hits at t. For a metal the radiance measured by the camera does not apply to the
// cone's direction: it reflects there what it mirrors along the cone, approximated by the environment; lamps are
// computed separately (mirror_lamp.glsl).
vec3 real_seen(Cone k, float t, float reach) {
  vec3 p = real_place(k, t), seen = real_radiance(p, reach);
  int mirror = mirror_at(p, k.w, reach + 2.0 * frame.cascade[0].w);
  if (mirror < 0) return seen;
  Bend bend = bend_at(mirror, k.w, k.tan_half);
  return mix(seen, bend.factor * environment_radiance(bend.w, bend.tan_half), bend.metallic);
}

// The same for the changed scene, in which the metal also mirrors virtual surfaces.
vec3 changed_seen(Cone k, float t, float reach) {
  vec3 p = real_place(k, t), seen = max(real_radiance(p, reach) + real_change(p, reach), vec3(0));
  int mirror = mirror_at(p, k.w, reach + 2.0 * frame.cascade[0].w);
  if (mirror < 0) return seen;
  Bend bend = bend_at(mirror, k.w, k.tan_half);
  vec3 n = frame.mirrors[mirror].plane.xyz;
  Cone on;
  on.from_virtual = on.from_real = p - (dot(n, p) - frame.mirrors[mirror].plane.w) * n;
  on.w = bend.w;
  on.tan_half = min(bend.tan_half, 1.0);
  vec2 virt = virtual_stretch(on);
  Layer v = Layer(0.0, 0.0, 0.0, 0.0);
  float min_m = 0.5 * frame.virtual_grid.w, at = max(min_m, virt.x);
  Past past = Past(0.0, 0.0, 0.0);
  float end = virt.x < virt.y ? virt.y : 0.0;
  for (int i = 0; i < kMaxSteps; ++i) {
    if (at >= end || v.hidden > 0.995) break;
    float wide = reach_of(on, at, min_m), d = virtual_distance(on.from_virtual + at * on.w);
    add_hit(v, virtual_hidden(past, d, at, wide), 1.0, at);
    at += careful_step(past, d, wide, min_m);
  }
  vec3 mirrored = (1.0 - v.hidden) * environment_radiance(bend.w, bend.tan_half) +
                  v.seen * virtual_radiance(on.from_virtual + v.at * on.w, on.w, reach_of(on, v.at, min_m), kFocusNear);
  return mix(seen, bend.factor * mirrored, bend.metallic);
}

// Change of radiance along a cone from a real surface by the objects: C_delta without the real surfaces' own change.
// gained: radiance of virtual surfaces; lost: L_mu that they occlude; hidden: the fraction of the real view that they
// occlude.
void delta_cone(Cone k, out vec3 gained, out vec3 lost, out float hidden) {
  vec2 known = known_stretch(k), virt = virtual_stretch(k);
  Layer v = Layer(0.0, 0.0, 0.0, 0.0), r = v;
  float min_m = 0.5 * frame.virtual_grid.w, t = min_m;
  Past past = Past(0.0, 0.0, 0.0);
  for (int i = 0; i < kMaxSteps; ++i) {
    // Nothing virtual ahead: if none was hit the change is 0, else only the remaining occlusion in the real scene
    // matters.
    if (virt.x > virt.y || (t > virt.y && (v.hidden == 0.0 || t > known.y)) || r.hidden > 0.995) break;
    float reach = reach_of(k, t, min_m);
    float dv = virtual_distance(k.from_virtual + t * k.w), dr = real_distance(real_place(k, t));
    dv = t > virt.y ? kFar : dv;
    dr = t < known.x ? known.x - t + reach : dr;
    add_hit(v, virtual_hidden(past, dv, t, reach), 1.0 - r.hidden, t);
    add_hit(r, hidden_fraction(dr / reach), v.hidden, t);
    t += careful_step(past, min(dv, dr), reach, min_m);
  }
  gained = lost = vec3(0);
  hidden = v.hidden;
  if (v.hidden > 0.0) {
    gained = v.seen * virtual_radiance(k.from_virtual + v.at * k.w, k.w, reach_of(k, v.at, min_m), kFocusFar);
    lost = frame.blocked.rgb * (r.seen * real_seen(k, r.at, reach_of(k, r.at, min_m)) +
                                v.hidden * (1.0 - r.hidden) * beyond_radiance(k.from_virtual, k.w, k.tan_half));
  }
}

// The change along a mirror's cone, all of C_delta, and the original radiance, as mirrors need both. gained: radiance
// of virtual surfaces, and the change of real ones; lost: L_mu that virtual ones occlude; all: C_mu.
void mirror_cone(Cone k, out vec3 gained, out vec3 lost, out vec3 all) {
  vec2 known = known_stretch(k), virt = virtual_stretch(k);
  Layer v = Layer(0.0, 0.0, 0.0, 0.0), r = v;
  float behind = 0.0;  // fraction of the visible real surfaces that is behind virtual ones
  bool near_virtual = virt.x < virt.y;
  float min_m = 0.5 * min(frame.cascade[0].w, near_virtual ? frame.virtual_grid.w : kFar), t = max(min_m, near_virtual ? 0.0 : known.x);
  Past past = Past(0.0, 0.0, 0.0);
  for (int i = 0; i < kMaxSteps; ++i) {
    if ((t > known.y && (t > virt.y || !near_virtual)) || r.hidden > 0.995) break;
    float reach = reach_of(k, t, min_m);
    float dv = virtual_distance(k.from_virtual + t * k.w), dr = real_distance(real_place(k, t));
    dv = t > virt.y || !near_virtual ? kFar : dv;
    dr = t < known.x ? known.x - t + reach : dr;
    add_hit(v, virtual_hidden(past, dv, t, reach), 1.0 - r.hidden, t);
    float before = r.seen;
    add_hit(r, hidden_fraction(dr / reach), 1.0, t);
    behind += (r.seen - before) * v.hidden;
    t += careful_step(past, min(dv, dr), reach, min_m);
  }
  float reach = reach_of(k, r.at, min_m), open = 1.0 - r.hidden;
  vec3 seen = real_seen(k, r.at, reach), sky = open * beyond_radiance(k.from_virtual, k.w, k.tan_half);
  all = r.seen * seen + sky;
  lost = frame.blocked.rgb * (behind * seen + v.hidden * sky);
  gained = v.seen * virtual_radiance(k.from_virtual + v.at * k.w, k.w, reach_of(k, v.at, min_m), kFocusFar) +
           (r.seen - behind) * real_change(real_place(k, r.at), reach) +
           open * (1.0 - v.hidden) * beyond_change(k.from_virtual, k.w);
}

// Change at a real surface by the change of other real surfaces: the rest of C_delta. beyond: the enclosure's part.
vec3 change_cone(Cone k, out vec3 beyond) {
  vec2 known = known_stretch(k), virt = virtual_stretch(k);
  Layer r = Layer(0.0, 0.0, 0.0, 0.0);
  float m_v = 0.0, min_m = 0.5 * frame.cascade[0].w, t = max(min_m, known.x);
  Past past = Past(0.0, 0.0, 0.0);
  for (int i = 0; i < kMaxSteps; ++i) {
    if (t >= known.y || max(r.hidden, m_v) > 0.995) break;
    float reach = reach_of(k, t, min_m);
    float dv = virtual_distance(k.from_virtual + t * k.w), dr = real_distance(real_place(k, t));
    dv = virt.x > virt.y || t > virt.y ? kFar : dv;
    m_v = max(m_v, virtual_hidden(past, dv, t, reach));
    add_hit(r, hidden_fraction(dr / reach), 1.0 - m_v, t);
    t += careful_step(past, min(dv, dr), reach, min_m);
  }
  beyond = (1.0 - m_v) * (1.0 - r.hidden) * beyond_change(k.from_virtual, k.w);
  return r.seen * real_change(real_place(k, r.at), reach_of(k, r.at, min_m));
}

// C_rho: radiance of the changed scene along a cone.
vec3 rho_cone(Cone k) {
  vec2 known = known_stretch(k), virt = virtual_stretch(k);
  Layer v = Layer(0.0, 0.0, 0.0, 0.0), r = v;
  float min_m = 0.5 * frame.virtual_grid.w, t = min_m;
  Past past = Past(0.0, 0.0, 0.0);
  for (int i = 0; i < kMaxSteps; ++i) {
    if ((t > known.y && t > virt.y) || max(r.hidden, v.hidden) > 0.995) break;
    float reach = reach_of(k, t, min_m);
    float dv = virtual_distance(k.from_virtual + t * k.w), dr = real_distance(real_place(k, t));
    dv = t > virt.y ? kFar : dv;
    add_hit(v, virtual_hidden(past, dv, t, reach), 1.0 - r.hidden, t);
    add_hit(r, hidden_fraction(dr / reach), 1.0 - v.hidden, t);
    t += careful_step(past, min(dv, dr), reach, min_m);
  }
  float reach = reach_of(k, r.at, min_m);
  return v.seen * virtual_radiance(k.from_virtual + v.at * k.w, k.w, reach_of(k, v.at, min_m), kFocusNear) +
         r.seen * changed_seen(k, r.at, reach) +
         (1.0 - v.hidden) * (1.0 - r.hidden) *
             max(beyond_radiance(k.from_virtual, k.w, k.tan_half) + beyond_change(k.from_virtual, k.w), vec3(0));
}

// C_mu: radiance of the real scene along a cone.
vec3 mu_cone(Cone k) {
  vec2 known = known_stretch(k);
  Layer r = Layer(0.0, 0.0, 0.0, 0.0);
  float min_m = 0.5 * frame.cascade[0].w, t = max(min_m, known.x);
  for (int i = 0; i < kMaxSteps; ++i) {
    if (t >= known.y || r.hidden > 0.995) break;
    float reach = reach_of(k, t, min_m), d = real_distance(real_place(k, t));
    add_hit(r, hidden_fraction(d / reach), 1.0, t);
    t += next_step(d, reach, min_m);
  }
  return r.seen * real_seen(k, r.at, reach_of(k, r.at, min_m)) +
         (1.0 - r.hidden) * beyond_radiance(k.from_virtual, k.w, k.tan_half);
}

// Shadow cones C_s (eq. 5.20): occlusion of a narrow cone up to t_far by virtual and by real surfaces. Two marches, as
// each takes longer steps alone, and most cones hit nothing virtual and skip the second.
float virtual_shadow(Cone k, float t_far) {
  vec2 virt = virtual_stretch(k);
  float m = 0.0, min_m = 0.5 * frame.virtual_grid.w, t = max(min_m, virt.x);
  Past past = Past(0.0, 0.0, 0.0);
  t_far = virt.x < virt.y ? min(t_far, virt.y) : 0.0;
  for (int i = 0; i < kMaxSteps; ++i) {
    if (t >= t_far || m > 0.995) break;
    float reach = reach_of(k, t, min_m), d = virtual_distance(k.from_virtual + t * k.w);
    m = max(m, virtual_hidden(past, d, t, reach));
    t += careful_step(past, d, reach, min_m);
  }
  return m;
}
float real_shadow(Cone k, float t_far) {
  vec2 known = known_stretch(k);
  float m = 0.0, min_m = 0.5 * frame.cascade[0].w, first = max(min_m, known.x), t = first;
  t_far = min(t_far, known.y);
  for (int i = 0; i < kMaxSteps; ++i) {
    if (t >= t_far || m > 0.995) break;
    float reach = reach_of(k, t, min_m), d = real_distance(real_place(k, t));
    m = max(m, hidden_fraction(d / reach));
    t += next_step(d, reach, min_m);
  }
  // Once more past what is gone. Loops that are not entered cost nothing on software devices, unlike branches; within
  // the loop above this would double its time also if nothing is gone.
  for (int j = 0; j < (frame.gone.w > 0.0 && m > 0.0 ? 1 : 0); ++j) {
    m = 0.0;
    t = first;
    for (int i = 0; i < kMaxSteps; ++i) {
      if (t >= t_far || m > 0.995) break;
      vec3 p = real_place(k, t);
      float reach = reach_of(k, t, min_m), d = real_distance(p), hidden = hidden_fraction(d / reach);
      m = hidden > m && !is_gone(p, d) ? hidden : m;
      t += next_step(d, reach, min_m);
    }
  }
  return m;
}
#endif
