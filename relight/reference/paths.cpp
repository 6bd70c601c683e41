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
constexpr float kFarthest_m = 1e6f;  // of absorption: without it, none over an infinite distance were not a number

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
  return pdf > 0 ? (light * (world_.open(a.lamp, ray.from_m) * balanced(pdf, lamp_pdf(lamp, ray.from_m, ray.w)))).eval()
                 : light;
}

Rgb Paths::on_the_way(const PathRay& ray, const Arrival& a, float pdf) const {
  const bool ends = a.at != Arrival::At::real || world_.real.hides(a.hit);
  Rgb sum = Rgb::Zero();
  for (std::size_t i = 0; i < world_.scene->lamps.size(); ++i) {
    const ReferenceLamp& lamp = world_.scene->lamps[i];
    if (lamp.hides) continue;
    const std::optional<float> t_m = lamp_hit(lamp, ray.from_m, ray.w);
    if (!t_m || (ends && *t_m > a.t_m)) continue;
    const float weight = pdf > 0 ? world_.open(i, ray.from_m) * balanced(pdf, lamp_pdf(lamp, ray.from_m, ray.w)) : 1;
    sum += weight * lamp_radiance(lamp, ray.from_m, ray.w);
  }
  return sum;
}

bool Paths::blocked_by_room(const Vector3f& from_m, const Vector3f& w, float limit_m, std::size_t lamp) const {
  if (behind_other_lamp(world_.scene->lamps, lamp, from_m, w, limit_m)) return true;
  return lamp == kNoLamp ? world_.real.hit(from_m, w, limit_m).has_value() : world_.real.blocked(from_m, w, limit_m);
}

template <typename Counts>
Rgb Paths::direct(const PathVertex& vertex, bool of_lamps, Counts counts) {
  Rgb sum = Rgb::Zero();
  const auto add = [&](const LightSample& s, const Vector3f& from_m, std::size_t lamp) {
    if (!(s.pdf > 0) || s.radiance.maxCoeff() <= 0) return;
    const Rgb f = vertex.response(s.w);
    if (f.maxCoeff() <= 0 || !counts(from_m, s.w, s.distance_m - kTracing.before_lamp_m, lamp)) return;
    sum += f * s.radiance * (balanced(s.pdf, vertex.pdf(s.w) + vertex.aim_pdf(s.w)) / s.pdf);
  };
  // Lamps are evaluated from the origin of the outgoing rays, so that both sampling strategies use the same densities.
  for (std::size_t i = 0; of_lamps && i < world_.scene->lamps.size(); ++i) {
    const ReferenceLamp& lamp = world_.scene->lamps[i];
    const Vector3f from_m = vertex.leave_to(lamp.centre_m);
    LightSample s = sample_lamp(lamp, from_m, sampler_.two());
    s.radiance *= world_.open(i, from_m);
    add(s, from_m, i);
  }
  if (world_.sky.is_picture()) {
    const LightSample s = world_.sky.sample(sampler_.two());
    add(s, vertex.transmits() ? vertex.leave(s.w) : vertex.leave(), kNoLamp);
  }
  return sum;
}

Rgb Paths::emitted_by_object(const MeshHit& hit, const SurfaceHit& surface, const Vector3f& w, float pdf) const {
  if (surface.unlit) return Rgb::Zero();
  if (!(pdf > 0) || surface.emission.maxCoeff() <= 0) return surface.emission;
  return surface.emission * balanced(pdf, world_.emitters.pdf(hit, w));
}

Rgb Paths::lit_by_objects(const PathVertex& vertex) {
  if (world_.emitters.empty()) return Rgb::Zero();
  Vector3f from_m = vertex.leave();
  const LightSample s = world_.emitters.sample(from_m, sampler_.two());
  if (!(s.pdf > 0)) return Rgb::Zero();
  if (vertex.transmits()) from_m = vertex.leave(s.w);
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

Paths::Vertex Paths::vertex_of(SurfaceHit surface, const Vector3f& w, bool of_object, Past& past) {
  BsdfParams& bsdf = surface.bsdf;
  if ((photons_ || world_.any_unlit) && bsdf.mirrors()) {
    const float of_interface = bsdf.diffuse.maxCoeff() > 0 ? interface_probability(bsdf, {0, 0, 1}) : 1;
    const bool chosen = of_interface >= 1 || sampler_.one() < of_interface;
    past.throughput /= chosen ? of_interface : 1 - of_interface;
    bsdf.lobes = chosen ? Lobes::interface : Lobes::body;
  }
  const bool interface = of_object && bsdf.transmits() && bsdf.lobes != Lobes::body;
  const bool receives = photons_ && (!bsdf.mirrors() || bsdf.lobes == Lobes::body);
  past.by_interface = interface;
  past.of_camera = past.of_camera && bsdf.lobes == Lobes::interface;
  if (!interface) past.from_receiver = receives;
  return {PathVertex(surface, w), receives};
}

Rgb Paths::photons_at(const Vertex& vertex, const SurfaceHit& surface) const {
  Rgb sum = Rgb::Zero();
  if (!vertex.receives) return sum;
  photons_->for_each_near(surface.position_m, surface.face, [&](const Photon& photon, float density) {
    sum += density * vertex.path.reflects(-photon.w) * photon.power_W;
  });
  return sum;
}

PathRay Paths::left(const PathVertex& vertex, const Vector3f& w, float pdf, Past& past) const {
  past.pdf = pdf;
  past.throughput *= vertex.response(w) / std::max(pdf, std::numeric_limits<float>::min());
  past.absorption = vertex.absorption(w, past.absorption);
  ++past.bounces;
  return {vertex.leave(w), w};
}

Rgb Paths::followed(PathRay ray, Past past, bool with_objects) {
  Rgb sum = Rgb::Zero();
  while (true) {
    const Arrival a = arrival(ray, with_objects);
    const Rgb before = past.throughput;
    past.throughput *= (-past.absorption * std::min(a.t_m, kFarthest_m)).exp();
    const bool of_lamps = !past.photons_bring_lamps();
    if (of_lamps) sum += before * on_the_way(ray, a, past.pdf);
    if (a.at == Arrival::At::sky || (a.at == Arrival::At::lamp && of_lamps))
      return sum + past.throughput * emitted(ray, a, past.pdf);
    if (a.at == Arrival::At::lamp) return sum;
    const bool of_object = a.at == Arrival::At::object;
    const SurfaceHit surface = (of_object ? world_.objects : world_.real).surface(a.hit, ray.w);
    if (surface.unlit && past.of_camera) return sum + past.throughput * surface.emission;
    if (of_object) sum += past.throughput * emitted_by_object(a.hit, surface, ray.w, past.pdf);
    const Vertex vertex = vertex_of(surface, ray.w, of_object, past);
    const auto open = [&](const Vector3f& from, const Vector3f& w, float limit, std::size_t lamp) {
      return !blocked_by_room(from, w, limit, lamp) && !(with_objects && world_.objects.blocked(from, w, limit));
    };
    sum += past.throughput * direct(vertex.path, !past.photons_bring_lamps(), open);
    if (with_objects) sum += past.throughput * (lit_by_objects(vertex.path) + photons_at(vertex, surface));
    if (!lives(past, past.chance_to_go_on())) return sum;
    const Vector3f w = vertex.path.sample(sampler_);
    ray = left(vertex.path, w, vertex.path.pdf(w), past);
    if (!(past.throughput.maxCoeff() > 0 && past.throughput.allFinite())) return sum;
  }
}

Rgb Paths::changed(const PathRay& ray, const Arrival& a, Past past) {
  if (a.at == Arrival::At::object) return followed(ray, past, true) - followed(ray, past, false);
  if (a.at != Arrival::At::real) return Rgb::Zero();  // a lamp or the sky, equal in both scenes
  const SurfaceHit surface = world_.real.surface(a.hit, ray.w);
  Vertex vertex = vertex_of(surface, ray.w, false, past);
  if (past.bounces < kPaths.aimed_bounces) vertex.path.aim_at(world_.places);
  const auto lost = [&](const Vector3f& from, const Vector3f& w, float limit, std::size_t lamp) {
    return world_.objects.blocked(from, w, limit) && !blocked_by_room(from, w, limit, lamp);
  };
  Rgb sum =
      past.throughput * (lit_by_objects(vertex.path) + photons_at(vertex, surface) - direct(vertex.path, true, lost));
  if (!lives(past, past.chance_to_go_on())) return sum;
  if (vertex.path.has_aim()) sum += changed_towards(vertex.path, vertex.path.aim(sampler_), past);
  return sum + changed_towards(vertex.path, vertex.path.sample(sampler_), past);
}

Rgb Paths::changed_towards(const PathVertex& vertex, const Vector3f& w, Past past) {
  // Each vertex that samples regions sends one ray by each of its two strategies; either may have sampled this
  // direction, so their densities are added (Veach & Guibas 1995, eq. 11).
  const PathRay ray = left(vertex, w, vertex.pdf(w) + vertex.aim_pdf(w), past);
  if (!(past.throughput.maxCoeff() > 0 && past.throughput.allFinite())) return Rgb::Zero();
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
