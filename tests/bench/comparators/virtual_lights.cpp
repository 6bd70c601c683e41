#include "tests/bench/comparators/virtual_lights.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "relight/objects/placement.h"

namespace lumigraft::comparators {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kLift_m = 1e-4f;  // offset from a surface
constexpr int kSkySamples = 256;  // for its power

constexpr float kWellOutside = 1.02f;  // radius factor of the sphere around the objects

/// A path's first segment.
struct Emitted {
  Vector3f from_m = Vector3f::Zero(), w = Vector3f::UnitZ();
  relight::Rgb flux_W = relight::Rgb::Zero();
};

Vector3f about(const Vector3f& axis, const Vector2f& u) {  // with a density of cosine / π
  Vector3f x, y;
  relight::basis(axis, x, y);
  const float r = std::sqrt(u.x()), phi = 2 * relight::kPi * u.y();
  return (r * std::cos(phi) * x + r * std::sin(phi) * y + std::sqrt(std::max(1 - u.x(), 0.0f)) * axis).normalized();
}

Vector3f any_direction(const Vector2f& u) { return relight::in_cone(Vector3f::UnitZ(), 2, u); }

relight::LightSample sky_sample(const relight::TraceWorld& world, const Vector2f& u) {
  if (world.sky.is_picture()) return world.sky.sample(u);
  relight::LightSample s;
  s.w = any_direction(u);
  s.radiance = world.sky.radiance(s.w);
  s.pdf = 1 / (4 * relight::kPi);
  return s;
}

relight::BoundingSphere around(const std::vector<Eigen::Vector4f>& spheres) {
  std::vector<Vector3f> ends_m;
  for (const Eigen::Vector4f& s : spheres) {
    for (int axis = 0; axis < 3; ++axis) {
      ends_m.push_back(s.head<3>() + s.w() * Vector3f::Unit(axis));
      ends_m.push_back(s.head<3>() - s.w() * Vector3f::Unit(axis));
    }
  }
  return ends_m.empty() ? relight::BoundingSphere{} : relight::bounding_sphere(ends_m);
}

/// Samples light emission. Half of the paths are aimed at the objects, the others follow the emission; both are
/// combined by multiple importance sampling (Veach & Guibas 1995).
class Sources {
 public:
  explicit Sources(const relight::TraceWorld& world) : world_(world) {
    std::vector<Eigen::Vector4f> spheres = world.objects.spheres();
    objects_ = around(spheres);
    spheres.insert(spheres.end(), world.real.spheres().begin(), world.real.spheres().end());
    all_ = around(spheres);
    for (const relight::ReferenceLamp& lamp : world.scene->lamps) {
      powers_.push_back(relight::kPi * area_m2(lamp) * relight::luminance(lamp.radiance));
    }
    float sky = 0;
    for (int i = 0; i < kSkySamples; ++i) {
      relight::Sampler sampler(~0u, 0, static_cast<std::uint32_t>(i));
      const relight::LightSample s = sky_sample(world, sampler.two());
      if (s.pdf > 0) sky += relight::luminance(s.radiance) / s.pdf / kSkySamples;
    }
    powers_.push_back(relight::kPi * all_.radius_m * all_.radius_m * sky);
    for (const float power : powers_) total_ += power;
  }

  Emitted sample(relight::Sampler& sampler, int paths) const {
    float choice = sampler.one() * total_;
    std::size_t i = 0;
    for (; i + 1 < powers_.size() && choice >= powers_[i]; ++i) choice -= powers_[i];
    const bool aimed = sampler.one() < 0.5f;
    const Vector2f u = sampler.two(), v = sampler.two();
    const float paths_of_this = static_cast<float>(paths) * powers_[i] / total_;
    if (!(paths_of_this > 0)) return {};
    Emitted e = i < world_.scene->lamps.size() ? of_lamp(world_.scene->lamps[i], u, v, aimed) : of_sky(u, v, aimed);
    e.flux_W /= paths_of_this;
    return e;
  }

 private:
  static float area_m2(const relight::ReferenceLamp& lamp) {
    return lamp.shape == relight::ReferenceLamp::Shape::sphere ? 4 * relight::kPi * lamp.radius_m * lamp.radius_m
                                                               : relight::area_m2(lamp);
  }

  Emitted of_lamp(const relight::ReferenceLamp& lamp, const Vector2f& u, const Vector2f& v, bool aimed) const {
    Emitted e;
    Vector3f normal = lamp.normal;
    if (lamp.shape == relight::ReferenceLamp::Shape::sphere) {
      normal = any_direction(u);
      e.from_m = lamp.centre_m + lamp.radius_m * normal;
    } else {
      e.from_m = relight::point_on(lamp, u);
    }
    const Vector3f to = objects_.centre_m - e.from_m;
    const float far_m = to.norm();
    const bool outside = objects_.radius_m > 0 && far_m > kWellOutside * objects_.radius_m;
    const float cone = outside ? relight::cone_of_sphere(objects_.radius_m, far_m) : 0;
    e.w = aimed && outside ? relight::in_cone(to / far_m, cone, v) : about(normal, v);
    const float cosine = normal.dot(e.w);
    if (!(cosine > 0)) return e;
    float pdf = cosine / relight::kPi;
    if (outside)
      pdf = 0.5f * pdf + (0.5f * (e.w - to / far_m).squaredNorm() <= cone ? 0.25f / (relight::kPi * cone) : 0.0f);
    e.flux_W = relight::lamp_radiance(lamp, e.from_m + e.w, -e.w) * (cosine * area_m2(lamp) / pdf);
    e.from_m += kLift_m * normal;
    return e;
  }

  Emitted of_sky(const Vector2f& u, const Vector2f& v, bool aimed) const {
    const relight::LightSample s = sky_sample(world_, u);
    Emitted e;
    if (!(s.pdf > 0)) return e;
    Vector3f x, y;
    relight::basis(s.w, x, y);
    // Through a disc perpendicular to the direction, covering everything or the objects.
    const auto through = [&](const relight::BoundingSphere& sphere) {
      return sphere.centre_m - sphere.centre_m.dot(s.w) * s.w;
    };
    const bool any = objects_.radius_m > 0;
    const relight::BoundingSphere& disc = aimed && any ? objects_ : all_;
    const float r = disc.radius_m * std::sqrt(v.x()), phi = 2 * relight::kPi * v.y();
    const Vector3f at = through(disc) + r * (std::cos(phi) * x + std::sin(phi) * y);
    float per_m2 = 1 / (relight::kPi * all_.radius_m * all_.radius_m);
    if (any) {
      const bool hits = (at - through(objects_)).norm() <= objects_.radius_m;
      per_m2 = 0.5f * per_m2 + (hits ? 0.5f / (relight::kPi * objects_.radius_m * objects_.radius_m) : 0.0f);
    }
    e.from_m = at + (all_.centre_m.dot(s.w) + all_.radius_m) * s.w;
    e.w = -s.w;
    e.flux_W = s.radiance / (s.pdf * per_m2);
    return e;
  }

  const relight::TraceWorld& world_;
  relight::BoundingSphere objects_, all_;
  float total_ = 0;
  std::vector<float> powers_;  ///< of the lamps, then the sky
};

std::vector<VirtualLight> follow(const relight::TraceWorld& world, Emitted e, relight::Sampler sampler, int bounces,
                                 bool with_objects) {
  std::vector<VirtualLight> lights;
  for (int bounce = 0; bounce < bounces && e.flux_W.maxCoeff() > 0; ++bounce) {
    float limit_m = std::numeric_limits<float>::infinity();
    for (const relight::ReferenceLamp& lamp : world.scene->lamps) {
      if (const auto t = relight::lamp_hit(lamp, e.from_m, e.w)) limit_m = std::min(limit_m, *t);
    }
    const auto real = world.real.hit(e.from_m, e.w, limit_m);
    if (real) limit_m = real->t_m;
    const auto object = with_objects && !world.objects.empty() ? world.objects.hit(e.from_m, e.w, limit_m)
                                                               : std::optional<relight::MeshHit>();
    if (!real && !object) return lights;
    const relight::SurfaceHit s = object ? world.objects.surface(*object, e.w) : world.real.surface(*real, e.w);
    e.flux_W *= s.bsdf.diffuse;
    e.from_m = s.position_m + kLift_m * s.face;
    e.w = about(s.normal, sampler.two());
    if (e.w.dot(s.face) <= 0) e.w -= 2 * e.w.dot(s.face) * s.face;
    lights.push_back({s.position_m, s.normal, e.flux_W / relight::kPi});
  }
  return lights;
}

}  // namespace

std::vector<LightPair> trace_virtual_lights(const relight::TraceWorld& world, int paths, int bounces,
                                            std::uint32_t seed) {
  const Sources sources(world);
  std::vector<LightPair> pairs;
  for (int i = 0; i < paths; ++i) {
    relight::Sampler sampler(seed, 0, static_cast<std::uint32_t>(i));
    const Emitted start = sources.sample(sampler, paths);
    const auto without = follow(world, start, sampler, bounces, false);
    const auto with = follow(world, start, sampler, bounces, true);
    for (std::size_t k = 0; k < std::max(without.size(), with.size()); ++k) {
      LightPair& pair = pairs.emplace_back();
      if (k < without.size()) pair.without = without[k];
      if (k < with.size()) pair.with = with[k];
    }
  }
  return pairs;
}

}  // namespace lumigraft::comparators
