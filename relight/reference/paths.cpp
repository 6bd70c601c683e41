#include "relight/reference/paths.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lumigraft::reference {
namespace {

using Eigen::Vector3f;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kLift = 3e-5f;        // off a surface, of a metre at 1 m from the origin
constexpr float kShort = 1e-4f;       // shadow rays end this much before the lamp
constexpr int kSureBounces = 3;       // before Russian roulette
constexpr float kMostToLive = 0.95f;  // of Russian roulette
constexpr float kSureShare = 0.1f;    // paths that split off with less throughput take part in Russian roulette
constexpr std::size_t kNoLamp = std::numeric_limits<std::size_t>::max();

/// Veach & Guibas 1995, balance heuristic.
float weight(float own_pdf, float other_pdf) { return own_pdf / (own_pdf + other_pdf); }

}  // namespace

/// A surface that a path has come to, with its shading frame and, while looking for objects, the cones they fill.
struct Paths::Vertex {
  Surface surface;
  Eigen::Matrix3f frame;  // columns x, y, normal
  Vector3f v;             // in the frame, to where the light goes
  struct Cone {
    Vector3f axis;
    float one_minus_cos;
  };
  std::vector<Cone> cones;

  Vertex(const Surface& s, const Vector3f& w) : surface(s) {
    Vector3f x, y;
    basis(s.normal, x, y);
    frame << x, y, s.normal;
    v = frame.transpose() * -w;
  }

  void look_for(const std::vector<Eigen::Vector4f>& spheres) {
    for (const Eigen::Vector4f& sphere : spheres) {
      const Vector3f to = sphere.head<3>() - surface.position_m;
      const float distance = to.norm();
      if (distance > 1.02f * sphere.w() && sphere.w() > 0) {
        cones.push_back({to / distance, cone_of_sphere(sphere.w(), distance)});
      }
    }
  }

  bool above(const Vector3f& w) const { return surface.face.dot(w) > 0; }
  Rgb reflected_times_cosine(const Vector3f& w) const {
    const Vector3f local = frame.transpose() * w;
    return above(w) && local.z() > 0 ? (reflected(surface.look, v, local) * local.z()).eval() : Rgb::Zero().eval();
  }

  Vector3f sample(Sampler& sampler) const { return (frame * sample_direction(surface.look, v, sampler)).normalized(); }
  float pdf(const Vector3f& w) const { return direction_pdf(surface.look, v, frame.transpose() * w); }

  /// Into one of the cones.
  Vector3f aim(Sampler& sampler) const {
    const auto i = static_cast<std::size_t>(sampler.one() * static_cast<float>(cones.size()));
    return in_cone(cones[i].axis, cones[i].one_minus_cos, sampler.two());
  }
  float aim_pdf(const Vector3f& w) const {
    float sum = 0;
    for (const Cone& cone : cones) {
      // 1 - cos from the chord: no cancellation for narrow cones.
      if (0.5f * (w - cone.axis).squaredNorm() <= cone.one_minus_cos) sum += 1 / (2 * kPi * cone.one_minus_cos);
    }
    return cones.empty() ? 0 : sum / static_cast<float>(cones.size());
  }

  Vector3f leave(const Vector3f& w) const {
    const float lift = kLift * (1 + surface.position_m.cwiseAbs().maxCoeff());
    return surface.position_m + std::copysign(lift, surface.face.dot(w)) * surface.face;
  }
};

Paths::Arrival Paths::arrival(const Ray& ray, bool with_objects) const {
  Arrival a;
  a.t_m = kInfinity;
  for (std::size_t i = 0; i < world_.scene->lamps.size(); ++i) {
    const std::optional<float> t = lamp_hit(world_.scene->lamps[i], ray.from_m, ray.w);
    if (t && *t < a.t_m) {
      a.at = Arrival::At::lamp;
      a.t_m = *t;
      a.lamp = i;
    }
  }
  const auto nearer = [&](const Meshes& meshes, Arrival::At at) {
    if (const std::optional<MeshHit> hit = meshes.hit(ray.from_m, ray.w, a.t_m)) {
      a.at = at;
      a.t_m = hit->t_m;
      a.hit = *hit;
    }
  };
  nearer(world_.real, Arrival::At::real);
  if (with_objects && !world_.objects.empty()) nearer(world_.objects, Arrival::At::object);
  return a;
}

Rgb Paths::emitted(const Ray& ray, const Arrival& a, float pdf) const {
  if (a.at == Arrival::At::sky) {
    const Rgb light = world_.sky.radiance(ray.w);
    return pdf > 0 ? (light * weight(pdf, world_.sky.pdf(ray.w))).eval() : light;
  }
  const ReferenceLamp& lamp = world_.scene->lamps[a.lamp];
  const Rgb light = lamp_radiance(lamp, ray.from_m, ray.w);
  return pdf > 0 ? (light * weight(pdf, lamp_pdf(lamp, ray.from_m, ray.w))).eval() : light;
}

bool Paths::blocked_by_room(const Vector3f& from_m, const Vector3f& w, float limit_m, std::size_t lamp) const {
  for (std::size_t i = 0; i < world_.scene->lamps.size(); ++i) {
    if (i == lamp) continue;
    const std::optional<float> t = lamp_hit(world_.scene->lamps[i], from_m, w);
    if (t && *t < limit_m) return true;
  }
  return world_.real.blocked(from_m, w, limit_m);
}

template <typename Counts>
Rgb Paths::direct(const Vertex& vertex, Counts counts) {
  Rgb sum = Rgb::Zero();
  const auto add = [&](const LightSample& s, const Vector3f& from_m, std::size_t lamp) {
    if (!(s.pdf > 0) || s.radiance.maxCoeff() <= 0) return;
    const Rgb f = vertex.reflected_times_cosine(s.w);
    if (f.maxCoeff() <= 0 || !counts(from_m, s.w, s.distance_m - kShort, lamp)) return;
    sum += f * s.radiance * (weight(s.pdf, vertex.pdf(s.w) + vertex.aim_pdf(s.w)) / s.pdf);
  };
  // Lamps are seen from the very point from which rays leave, so that both ways to find them agree on densities.
  const Vector3f from_m = vertex.leave(vertex.surface.face);
  for (std::size_t i = 0; i < world_.scene->lamps.size(); ++i) {
    add(sample_lamp(world_.scene->lamps[i], from_m, sampler_.two()), from_m, i);
  }
  if (world_.sky.is_picture()) add(world_.sky.sample(sampler_.two()), from_m, kNoLamp);
  return sum;
}

float Paths::Past::chance_to_go_on() const {
  return bounces < kSureBounces ? 1 : std::min(throughput.maxCoeff(), kMostToLive);
}

bool Paths::lives(Past& past, float chance) {
  if (chance >= 1) return true;
  if (!(sampler_.one() < chance)) return false;
  past.throughput /= chance;
  return true;
}

bool Paths::turn(const Vertex& vertex, Past& past, Ray& ray) {
  ray.w = vertex.sample(sampler_);
  past.pdf = vertex.pdf(ray.w);
  if (!(past.pdf > 0)) return false;
  past.throughput *= vertex.reflected_times_cosine(ray.w) / past.pdf;
  ray.from_m = vertex.leave(ray.w);
  ++past.bounces;
  return past.throughput.maxCoeff() > 0 && past.throughput.allFinite();
}

Rgb Paths::followed(Ray ray, Past past, bool with_objects) {
  Rgb sum = Rgb::Zero();
  while (true) {
    const Arrival a = arrival(ray, with_objects);
    if (a.at == Arrival::At::sky || a.at == Arrival::At::lamp) {
      return sum + past.throughput * emitted(ray, a, past.pdf);
    }
    const Meshes& meshes = a.at == Arrival::At::object ? world_.objects : world_.real;
    const Vertex vertex(meshes.surface(a.hit, ray.w), ray.w);
    sum +=
        past.throughput * direct(vertex, [&](const Vector3f& from, const Vector3f& w, float limit, std::size_t lamp) {
          return !blocked_by_room(from, w, limit, lamp) && !(with_objects && world_.objects.blocked(from, w, limit));
        });
    if (!lives(past, past.chance_to_go_on()) || !turn(vertex, past, ray)) return sum;
  }
}

Rgb Paths::split(const Vertex& vertex, const Ray& ray, Past past) {
  // Both ways to look for objects, by material and by cone, may have found this direction: their densities sum up.
  past.pdf = vertex.pdf(ray.w) + vertex.aim_pdf(ray.w);
  past.throughput *= vertex.reflected_times_cosine(ray.w) / past.pdf;
  ++past.bounces;
  if (!lives(past, past.throughput.maxCoeff() / kSureShare)) return Rgb::Zero();
  return followed(ray, past, true) - followed(ray, past, false);
}

Rgb Paths::changed(Ray ray, Arrival a, Past past) {
  Rgb sum = Rgb::Zero();
  while (a.at == Arrival::At::real) {
    Vertex vertex(world_.real.surface(a.hit, ray.w), ray.w);
    vertex.look_for(world_.objects.spheres());
    sum -=
        past.throughput * direct(vertex, [&](const Vector3f& from, const Vector3f& w, float limit, std::size_t lamp) {
          return world_.objects.blocked(from, w, limit) && !blocked_by_room(from, w, limit, lamp);
        });
    if (!lives(past, past.chance_to_go_on())) return sum;
    if (!vertex.cones.empty()) {
      const Vector3f w = vertex.aim(sampler_);
      const Ray aimed{vertex.leave(w), w};
      if (vertex.above(w) && arrival(aimed, true).at == Arrival::At::object) sum += split(vertex, aimed, past);
    }
    const Past before = past;
    if (!turn(vertex, past, ray)) return sum;
    a = arrival(ray, true);
    if (a.at == Arrival::At::object) return sum + split(vertex, ray, before);
  }
  return sum;  // a lamp or the sky, the same in both worlds
}

CameraSample Paths::change(const Ray& ray) {
  const Arrival a = arrival(ray, true);
  if (a.at == Arrival::At::object) return {true, followed(ray, {}, true)};
  return {false, changed(ray, a, {})};
}

}  // namespace lumigraft::reference
