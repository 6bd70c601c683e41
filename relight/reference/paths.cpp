#include "relight/reference/paths.h"

#include <algorithm>
#include <limits>

#include "relight/reference/parameters.h"
#include "relight/tracing/parameters.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::size_t kNoLamp = std::numeric_limits<std::size_t>::max(), kObject = kNoLamp - 1;

}  // namespace

Paths::Arrival Paths::arrival(const PathRay& ray, bool with_objects) const {
  Arrival a;
  a.t_m = kInfinity;
  if (const auto lamp = nearest_lamp(world_.scene->lamps, ray.from_m, ray.w)) {
    a.at = Arrival::At::lamp;
    a.t_m = lamp->t_m;
    a.lamp = lamp->lamp;
  }
  const auto nearer = [&](const Meshes& meshes, Arrival::At at) {
    const std::optional<MeshHit> hit = meshes.hit(ray.from_m, ray.w, a.t_m);
    if (hit && (a.at != Arrival::At::lamp || meshes.hides(*hit))) {
      a.at = at;
      a.t_m = hit->t_m;
      a.hit = *hit;
    }
  };
  nearer(world_.real, Arrival::At::real);
  if (with_objects && !world_.objects.empty()) nearer(world_.objects, Arrival::At::object);
  return a;
}

Rgb Paths::emitted(const PathRay& ray, const Arrival& a, float pdf) const {
  if (a.at == Arrival::At::sky) {
    const Rgb light = world_.sky.radiance(ray.w);
    return pdf > 0 ? (light * balanced(pdf, world_.sky.pdf(ray.w))).eval() : light;
  }
  const ReferenceLamp& lamp = world_.scene->lamps[a.lamp];
  const Rgb light = lamp_radiance(lamp, ray.from_m, ray.w);
  return pdf > 0 ? (light * balanced(pdf, lamp_pdf(lamp, ray.from_m, ray.w))).eval() : light;
}

Rgb Paths::on_the_way(const PathRay& ray, const Arrival& a, float pdf) const {
  const bool ends = a.at != Arrival::At::real || world_.real.hides(a.hit);
  Rgb sum = Rgb::Zero();
  for (const ReferenceLamp& lamp : world_.scene->lamps) {
    if (lamp.hides) continue;
    const std::optional<float> t_m = lamp_hit(lamp, ray.from_m, ray.w);
    if (!t_m || (ends && *t_m > a.t_m)) continue;
    const float weight = pdf > 0 ? balanced(pdf, lamp_pdf(lamp, ray.from_m, ray.w)) : 1;
    sum += weight * lamp_radiance(lamp, ray.from_m, ray.w);
  }
  return sum;
}

bool Paths::blocked_by_room(const Vector3f& from_m, const Vector3f& w, float limit_m, std::size_t lamp) const {
  if (behind_other_lamp(world_.scene->lamps, lamp, from_m, w, limit_m)) return true;
  return lamp == kNoLamp ? world_.real.hit(from_m, w, limit_m).has_value() : world_.real.blocked(from_m, w, limit_m);
}

template <typename Counts>
Rgb Paths::direct(const PathVertex& vertex, Counts counts) {
  Rgb sum = Rgb::Zero();
  const auto add = [&](const LightSample& s, const Vector3f& from_m, std::size_t lamp) {
    if (!(s.pdf > 0) || s.radiance.maxCoeff() <= 0) return;
    const Rgb f = vertex.response(s.w);
    if (f.maxCoeff() <= 0 || !counts(from_m, s.w, s.distance_m - kTracing.before_lamp_m, lamp)) return;
    sum += f * s.radiance * (balanced(s.pdf, vertex.pdf(s.w) + vertex.aim_pdf(s.w)) / s.pdf);
  };
  // Lamps are evaluated from the origin of the outgoing rays, so that both sampling strategies use the same densities.
  const Vector3f from_m = vertex.leave();
  for (std::size_t i = 0; i < world_.scene->lamps.size(); ++i) {
    add(sample_lamp(world_.scene->lamps[i], from_m, sampler_.two()), from_m, i);
  }
  if (world_.sky.is_picture()) add(world_.sky.sample(sampler_.two()), from_m, kNoLamp);
  return sum;
}

Rgb Paths::emitted_by_object(const MeshHit& hit, const SurfaceHit& surface, const Vector3f& w, float pdf) const {
  if (!(pdf > 0) || surface.emission.maxCoeff() <= 0) return surface.emission;
  return surface.emission * balanced(pdf, world_.emitters.pdf(hit, w));
}

Rgb Paths::lit_by_objects(const PathVertex& vertex) {
  if (world_.emitters.empty()) return Rgb::Zero();
  const Vector3f from_m = vertex.leave();
  const LightSample s = world_.emitters.sample(from_m, sampler_.two());
  if (!(s.pdf > 0)) return Rgb::Zero();
  const Rgb f = vertex.response(s.w);
  const float limit_m = s.distance_m - kTracing.before_lamp_m;
  if (f.maxCoeff() <= 0 || world_.objects.blocked(from_m, s.w, limit_m) ||
      blocked_by_room(from_m, s.w, limit_m, kObject))
    return Rgb::Zero();
  return f * s.radiance * (balanced(s.pdf, vertex.pdf(s.w) + vertex.aim_pdf(s.w)) / s.pdf);
}

float Paths::Past::chance_to_go_on() const {
  return bounces < kPaths.sure_bounces ? 1 : std::min(throughput.maxCoeff(), kPaths.max_survival);
}

bool Paths::lives(Past& past, float chance) {
  if (chance >= 1) return true;
  if (!(sampler_.one() < chance)) return false;
  past.throughput /= chance;
  return true;
}

Rgb Paths::followed(PathRay ray, Past past, bool with_objects) {
  Rgb sum = Rgb::Zero();
  while (true) {
    const Arrival a = arrival(ray, with_objects);
    sum += past.throughput * on_the_way(ray, a, past.pdf);
    if (a.at == Arrival::At::sky || a.at == Arrival::At::lamp) return sum + past.throughput * emitted(ray, a, past.pdf);
    const Meshes& meshes = a.at == Arrival::At::object ? world_.objects : world_.real;
    const SurfaceHit surface = meshes.surface(a.hit, ray.w);
    const PathVertex vertex(surface, ray.w);
    if (a.at == Arrival::At::object) sum += past.throughput * emitted_by_object(a.hit, surface, ray.w, past.pdf);
    const auto open = [&](const Vector3f& from, const Vector3f& w, float limit, std::size_t lamp) {
      return !blocked_by_room(from, w, limit, lamp) && !(with_objects && world_.objects.blocked(from, w, limit));
    };
    sum += past.throughput * direct(vertex, open);
    if (with_objects) sum += past.throughput * lit_by_objects(vertex);
    if (!lives(past, past.chance_to_go_on())) return sum;
    ray.w = vertex.sample(sampler_);
    ray.from_m = vertex.leave(ray.w);
    past.pdf = vertex.pdf(ray.w);
    past.throughput *= vertex.response(ray.w) / std::max(past.pdf, std::numeric_limits<float>::min());
    ++past.bounces;
    if (!(past.throughput.maxCoeff() > 0 && past.throughput.allFinite())) return sum;
  }
}

Rgb Paths::changed(const PathRay& ray, const Arrival& a, Past past) {
  if (a.at == Arrival::At::object) return followed(ray, past, true) - followed(ray, past, false);
  if (a.at != Arrival::At::real) return Rgb::Zero();  // a lamp or the sky, equal in both scenes
  PathVertex vertex(world_.real.surface(a.hit, ray.w), ray.w);
  if (past.bounces < kPaths.aimed_bounces) vertex.aim_at(world_.places);
  const auto lost = [&](const Vector3f& from, const Vector3f& w, float limit, std::size_t lamp) {
    return world_.objects.blocked(from, w, limit) && !blocked_by_room(from, w, limit, lamp);
  };
  Rgb sum = past.throughput * (lit_by_objects(vertex) - direct(vertex, lost));
  if (!lives(past, past.chance_to_go_on())) return sum;
  if (vertex.has_aim()) sum += changed_towards(vertex, vertex.aim(sampler_), past);
  return sum + changed_towards(vertex, vertex.sample(sampler_), past);
}

Rgb Paths::changed_towards(const PathVertex& vertex, const Vector3f& w, Past past) {
  // Each vertex that samples regions sends one ray by each of its two strategies; either may have sampled this
  // direction, so their densities are added (Veach & Guibas 1995, eq. 11).
  past.pdf = vertex.pdf(w) + vertex.aim_pdf(w);
  past.throughput *= vertex.response(w) / std::max(past.pdf, std::numeric_limits<float>::min());
  ++past.bounces;
  if (!(past.throughput.maxCoeff() > 0 && past.throughput.allFinite())) return Rgb::Zero();
  const PathRay ray{vertex.leave(w), w};
  const Arrival a = arrival(ray, true);
  if (a.at == Arrival::At::object) {
    if (!lives(past, past.throughput.maxCoeff() / kPaths.sure_split)) return Rgb::Zero();
  } else if (vertex.has_aim()) {
    if (!lives(past, past.throughput.maxCoeff() / kPaths.sure_on)) return Rgb::Zero();
  }
  return changed(ray, a, past);
}

CameraSample Paths::change(const PathRay& ray) {
  const Arrival a = arrival(ray, true);
  if (a.at == Arrival::At::object) return {true, followed(ray, {}, true), a.t_m};
  return {false, changed(ray, a, {})};
}

std::optional<CameraSample> Paths::hidden_object(const PathRay& ray) {
  if (world_.objects.empty()) return std::nullopt;
  const std::optional<MeshHit> hit = world_.objects.hit(ray.from_m, ray.w, kInfinity);
  if (!hit) return std::nullopt;
  const Vector3f before_m = ray.from_m + (hit->t_m - kTracing.before_lamp_m) * ray.w;
  return CameraSample{true, followed({before_m, ray.w}, {}, true), hit->t_m};
}

}  // namespace lumigraft::relight
