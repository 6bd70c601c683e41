#include "relight/tracing/light_samples.h"

#include <algorithm>
#include <cmath>

#include "relight/tracing/sampler.h"
#include "relight/tracing/vertex.h"

namespace lumigraft::relight {

using Eigen::Vector3f;

LightSampleSet::LightSampleSet(const ReferenceLamp& lamp, std::uint32_t seed) : lamp_(lamp), sets_(kSets + 1) {
  const bool sphere = lamp.shape == ReferenceLamp::Shape::sphere;
  if (!sphere) area_m2_ = area_m2(lamp);
  for (int s = 0; s <= kSets; ++s) {
    for (int k = 0; k < RayFan::kMaxRays; ++k) {
      // A Sobol' sequence: every block of a power of two is stratified, and so is the whole.
      const std::uint32_t point = static_cast<std::uint32_t>(s == kAll ? k : s * RayFan::kMaxRays + k);
      Sampler sampler(seed, s == kAll ? 1 : 0, point);
      const Eigen::Vector2f u = sampler.two();
      const float phi = 2 * kPi * u.y();
      const Vector3f at = sphere ? Vector3f(std::cos(phi), std::sin(phi), u.x()) : point_on(lamp, u);
      Set& set = sets_[static_cast<std::size_t>(s)];
      set.x[static_cast<std::size_t>(k)] = at.x();
      set.y[static_cast<std::size_t>(k)] = at.y();
      set.z[static_cast<std::size_t>(k)] = at.z();
    }
  }
}

void ShadowRayPacket::keep_first(int count) {
  const float scale = static_cast<float>(RayFan::kMaxRays) / static_cast<float>(count);
  rays.some &= (1u << count) - 1;
  all = 0;
  for (int k = 0; k < RayFan::kMaxRays; ++k) {
    float& w = weight[static_cast<std::size_t>(k)];
    w = k < count ? scale * w : 0;
    all += w;
  }
}

float LightSampleSet::unhidden(const SurfaceHit& surface) const {
  if (lamp_.shape == ReferenceLamp::Shape::sphere) {
    const Vector3f to = lamp_.centre_m - surface.position_m;
    const float far = to.norm(), cosine = surface.normal.dot(to) / far, sine = lamp_.radius_m / far;
    // A sphere entirely above the horizon (Lambert 1760).
    if (std::min(cosine, surface.face.dot(to) / far) > sine) return kPi * sine * sine * cosine;
  }
  return from(surface, kAll).all;
}

ShadowRayPacket LightSampleSet::from(const SurfaceHit& surface, int number) const {
  ShadowRayPacket fan;
  fan.rays.from_m = ray_origin(surface, surface.face);
  fan.weight.fill(0);
  const Set& set = sets_[static_cast<std::size_t>(number)];
  const Vector3f to = lamp_.centre_m - fan.rays.from_m;
  Row x, y, z, distance, weight;
  if (lamp_.shape == ReferenceLamp::Shape::sphere) {
    const float far = to.norm();
    if (far <= lamp_.radius_m) return fan;
    const Vector3f axis = to / far;
    const float cap = cone_of_sphere(lamp_.radius_m, far), r2 = lamp_.radius_m * lamp_.radius_m;
    Vector3f a, b;
    basis(axis, a, b);
    for (std::size_t k = 0; k < RayFan::kMaxRays; ++k) {
      const float below = set.z[k] * cap, sine2 = std::max(below * (2 - below), 0.0f), s = std::sqrt(sine2);
      const float p = s * set.x[k], q = s * set.y[k], r = 1 - below;
      x[k] = p * a.x() + q * b.x() + r * axis.x();
      y[k] = p * a.y() + q * b.y() + r * axis.y();
      z[k] = p * a.z() + q * b.z() + r * axis.z();
      distance[k] = far * r - std::sqrt(std::max(r2 - far * far * sine2, 0.0f));
      weight[k] = 2 * kPi * cap;
    }
  } else {
    const Vector3f &from = fan.rays.from_m, &n = lamp_.normal;
    const float beam = 1 / (lamp_.cos_full - lamp_.cos_none);
    for (std::size_t k = 0; k < RayFan::kMaxRays; ++k) {
      const float dx = set.x[k] - from.x(), dy = set.y[k] - from.y(), dz = set.z[k] - from.z();
      const float d2 = dx * dx + dy * dy + dz * dz, d = std::sqrt(d2);
      x[k] = dx / d;
      y[k] = dy / d;
      z[k] = dz / d;
      distance[k] = d;
      const float cosine = std::max(-(n.x() * x[k] + n.y() * y[k] + n.z() * z[k]), 0.0f);
      const float s = std::clamp((cosine - lamp_.cos_none) * beam, 0.0f, 1.0f);
      weight[k] = area_m2_ * cosine / d2 * (s * s * (3 - 2 * s));
    }
  }
  const Vector3f &n = surface.normal, &f = surface.face;
  for (std::size_t k = 0; k < RayFan::kMaxRays; ++k) {
    const float cosine = n.x() * x[k] + n.y() * y[k] + n.z() * z[k];
    const float above = f.x() * x[k] + f.y() * y[k] + f.z() * z[k];
    weight[k] = above > 0 && cosine > 0 && weight[k] > 0 ? weight[k] * cosine / RayFan::kMaxRays : 0;
    fan.all += weight[k];
  }
  fan.weight = weight;
  for (std::size_t k = 0; k < RayFan::kMaxRays; ++k) {
    if (!(weight[k] > 0)) continue;
    fan.rays.some |= 1u << k;
    fan.rays.w[k] = {x[k], y[k], z[k]};
    fan.rays.limit_m[k] = before_lamp_body_m(lamp_, distance[k]);
  }
  return fan;
}

Rgb unoccluded_irradiance(const reconstruct::Illumination& light, const std::vector<LightSampleSet>& lamps,
                          const SurfaceHit& surface) {
  Rgb irradiance = reconstruct::sh_irradiance(light.environment_sh, surface.normal).array().max(0);
  for (const LightSampleSet& lamp : lamps) irradiance += lamp.irradiance(surface);
  return irradiance;
}

}  // namespace lumigraft::relight
