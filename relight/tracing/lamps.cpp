#include "relight/tracing/lamps.h"

#include <algorithm>
#include <cmath>

#include "relight/tracing/bsdf.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

std::optional<float> sphere_hit(const ReferenceLamp& lamp, const Vector3f& from_m, const Vector3f& w) {
  // From the ray's point nearest to the centre: accurate for small distant spheres.
  const Vector3f to = lamp.centre_m - from_m;
  const float along = to.dot(w), r2 = lamp.radius_m * lamp.radius_m, off2 = (to - along * w).squaredNorm();
  if (off2 > r2) return std::nullopt;
  const float half = std::sqrt(r2 - off2);
  const float t = along - half > 0 ? along - half : along + half;
  return t > 0 ? std::optional(t) : std::nullopt;
}

/// Whether a flat lamp contains a point of its plane, from its centre.
bool covers(const ReferenceLamp& lamp, const Vector3f& at) {
  const Vector3f &u = lamp.half_u_m, &v = lamp.half_v_m;
  if (lamp.shape == ReferenceLamp::Shape::disc) return at.squaredNorm() <= lamp.radius_m * lamp.radius_m;
  if (lamp.shape == ReferenceLamp::Shape::rectangle)
    return std::abs(at.dot(u)) <= u.squaredNorm() && std::abs(at.dot(v)) <= v.squaredNorm();
  // at = a u + b v
  const float area = u.cross(v).squaredNorm(), a = at.cross(v).dot(u.cross(v)), b = u.cross(at).dot(u.cross(v));
  return a * a + b * b <= area * area;
}

}  // namespace

float area_m2(const ReferenceLamp& lamp) {
  if (lamp.shape == ReferenceLamp::Shape::disc) return kPi * lamp.radius_m * lamp.radius_m;
  const float half_square_m2 = lamp.half_u_m.cross(lamp.half_v_m).norm();
  return lamp.shape == ReferenceLamp::Shape::ellipse ? kPi * half_square_m2 : 4 * half_square_m2;
}

Vector3f point_on(const ReferenceLamp& lamp, const Vector2f& u) {
  if (lamp.shape == ReferenceLamp::Shape::rectangle) {
    return lamp.centre_m + (2 * u.x() - 1) * lamp.half_u_m + (2 * u.y() - 1) * lamp.half_v_m;
  }
  const float r = std::sqrt(u.x()), phi = 2 * kPi * u.y();
  if (lamp.shape == ReferenceLamp::Shape::ellipse)
    return lamp.centre_m + r * (std::cos(phi) * lamp.half_u_m + std::sin(phi) * lamp.half_v_m);
  Vector3f x, y;
  basis(lamp.normal, x, y);
  return lamp.centre_m + lamp.radius_m * r * (std::cos(phi) * x + std::sin(phi) * y);
}

void basis(const Vector3f& n, Vector3f& x, Vector3f& y) {
  const float sign = std::copysign(1.0f, n.z()), a = -1 / (sign + n.z()), b = n.x() * n.y() * a;
  x = {1 + sign * n.x() * n.x() * a, sign * b, -sign * n.x()};
  y = {b, sign + n.y() * n.y() * a, -n.y()};
}

Vector3f in_cone(const Vector3f& axis, float one_minus_cos, const Vector2f& u) {
  Vector3f x, y;
  basis(axis, x, y);
  const float below = u.x() * one_minus_cos, s = std::sqrt(std::max(below * (2 - below), 0.0f)), phi = 2 * kPi * u.y();
  return (s * std::cos(phi) * x + s * std::sin(phi) * y + (1 - below) * axis).normalized();
}

float cone_of_sphere(float radius_m, float distance_m) {
  const float sine = radius_m / distance_m, sine2 = sine * sine;
  return sine2 / (1 + std::sqrt(std::max(1 - sine2, 0.0f)));
}

std::optional<LampHit> nearest_lamp(const std::vector<ReferenceLamp>& lamps, const Vector3f& from_m,
                                    const Vector3f& w) {
  std::optional<LampHit> nearest;
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    if (!lamps[i].hides) continue;
    const std::optional<float> t = lamp_hit(lamps[i], from_m, w);
    if (t && (!nearest || *t < nearest->t_m)) nearest = LampHit{i, *t};
  }
  return nearest;
}

bool behind_other_lamp(const std::vector<ReferenceLamp>& lamps, std::size_t lamp, const Vector3f& from_m,
                       const Vector3f& w, float limit_m) {
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    if (i == lamp || !lamps[i].hides) continue;
    const std::optional<float> t = lamp_hit(lamps[i], from_m, w);
    if (t && *t < limit_m) return true;
  }
  return false;
}

float lamp_reach_m(const ReferenceLamp& lamp) {
  if (lamp.shape == ReferenceLamp::Shape::rectangle) return (lamp.half_u_m + lamp.half_v_m).norm();
  if (lamp.shape == ReferenceLamp::Shape::ellipse)
    return std::sqrt(lamp.half_u_m.squaredNorm() + lamp.half_v_m.squaredNorm());
  return lamp.radius_m;
}

std::optional<float> lamp_hit(const ReferenceLamp& lamp, const Vector3f& from_m, const Vector3f& w) {
  if (lamp.shape == ReferenceLamp::Shape::sphere) return sphere_hit(lamp, from_m, w);
  const float cosine = lamp.normal.dot(w);
  if (std::abs(cosine) < 1e-7f) return std::nullopt;
  const float t = lamp.normal.dot(lamp.centre_m - from_m) / cosine;
  if (!(t > 0)) return std::nullopt;
  const Vector3f at = from_m + t * w - lamp.centre_m;
  return covers(lamp, at) ? std::optional(t) : std::nullopt;
}

Rgb lamp_radiance(const ReferenceLamp& lamp, const Vector3f& from_m, const Vector3f& w) {
  if (lamp.shape == ReferenceLamp::Shape::sphere) {
    return (from_m - lamp.centre_m).squaredNorm() > lamp.radius_m * lamp.radius_m ? lamp.radiance : Rgb::Zero().eval();
  }
  const float cosine = -lamp.normal.dot(w);
  if (cosine <= 0) return Rgb::Zero();
  const float s = std::clamp((cosine - lamp.cos_none) / (lamp.cos_full - lamp.cos_none), 0.0f, 1.0f);
  return lamp.radiance * (s * s * (3 - 2 * s));
}

LightSample sample_lamp(const ReferenceLamp& lamp, const Vector3f& from_m, const Vector2f& u) {
  LightSample sample;
  if (lamp.shape == ReferenceLamp::Shape::sphere) {
    const Vector3f to = lamp.centre_m - from_m;
    const float distance = to.norm();
    if (distance <= lamp.radius_m) return sample;
    const float cap = cone_of_sphere(lamp.radius_m, distance);
    sample.w = in_cone(to / distance, cap, u);
    sample.distance_m = sphere_hit(lamp, from_m, sample.w).value_or(distance);
    sample.pdf = 1 / (2 * kPi * cap);
  } else {
    const Vector3f to = point_on(lamp, u) - from_m;
    sample.distance_m = to.norm();
    sample.w = to / sample.distance_m;
    const float cosine = -lamp.normal.dot(sample.w);
    if (!(cosine > 0)) return sample;
    sample.pdf = sample.distance_m * sample.distance_m / (cosine * area_m2(lamp));
  }
  sample.radiance = lamp_radiance(lamp, from_m, sample.w);
  return sample;
}

float lamp_pdf(const ReferenceLamp& lamp, const Vector3f& from_m, const Vector3f& w) {
  if (lamp.shape == ReferenceLamp::Shape::sphere) {
    const float distance = (lamp.centre_m - from_m).norm();
    return distance <= lamp.radius_m ? 0 : 1 / (2 * kPi * cone_of_sphere(lamp.radius_m, distance));
  }
  const float cosine = -lamp.normal.dot(w);
  const std::optional<float> t = lamp_hit(lamp, from_m, w);
  return t && cosine > 0 ? *t * *t / (cosine * area_m2(lamp)) : 0;
}

}  // namespace lumigraft::relight
