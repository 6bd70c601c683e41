#include "relight/tracing/photon_tracing.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>

#include "relight/tracing/lamps.h"
#include "relight/tracing/parallel_for.h"
#include "relight/tracing/parameters.h"
#include "relight/tracing/vertex.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

/// Photons from one lamp towards the bounding sphere of one object.
struct Beam {
  std::size_t lamp = 0;
  std::uint32_t mesh = 0;
  Eigen::Vector4f sphere = Eigen::Vector4f::Zero();
  float power = 0;  ///< about proportional
  int photons = 0;
};

struct Emitted {
  Vector3f from_m, w;
  Rgb power_W = Rgb::Zero();  ///< of a beam of one photon
};

float whole_cone(float radius_m, float distance_m) {
  return distance_m > radius_m ? cone_of_sphere(radius_m, distance_m) : 2;  // all directions from within
}

/// Covers every ray from the lamp that hits the object's sphere once, at least.
Emitted emitted(const ReferenceLamp& lamp, const Eigen::Vector4f& sphere, Sampler& sampler) {
  const Eigen::Vector2f on_lamp = sampler.two(), direction = sampler.two();
  const Vector3f centre = sphere.head<3>();
  Emitted e;
  const bool bulb = lamp.shape == ReferenceLamp::Shape::sphere;
  e.from_m = bulb ? lamp.centre_m : point_on(lamp, on_lamp);
  const Vector3f to = centre - e.from_m;
  const float distance_m = to.norm();
  const float cone = whole_cone(sphere.w() + (bulb ? lamp.radius_m : 0), distance_m);
  e.w = in_cone(distance_m > 0 ? (to / distance_m).eval() : Vector3f::UnitZ(), cone, direction);
  float area_m2 = 0;
  if (bulb) {
    // A sphere shows the same disc to all directions.
    Vector3f x, y;
    basis(e.w, x, y);
    const float r = std::sqrt(on_lamp.x()), phi = 2 * kPi * on_lamp.y(), up = std::sqrt(std::max(1 - r * r, 0.0f));
    e.from_m += lamp.radius_m * (r * std::cos(phi) * x + r * std::sin(phi) * y + up * e.w);
    area_m2 = kPi * lamp.radius_m * lamp.radius_m;
  } else {
    area_m2 = relight::area_m2(lamp) * std::max(lamp.normal.dot(e.w), 0.0f);
  }
  const Vector3f before_m = e.from_m + std::max(distance_m, 1.0f) * e.w;
  e.power_W = lamp_radiance(lamp, before_m, -e.w) * (area_m2 * 2 * kPi * cone);
  return e;
}

bool is_target(const PhotonScene& scene, std::uint32_t mesh) {
  return scene.objects.transmits(mesh) || (scene.any_reflects && scene.any_reflects(mesh));
}

std::vector<Beam> beams_of(const PhotonScene& scene, int count) {
  std::vector<Beam> beams;
  float all = 0;
  const std::vector<Eigen::Vector4f>& spheres = scene.objects.spheres();
  for (std::size_t lamp = 0; lamp < scene.lamps.size(); ++lamp) {
    for (std::uint32_t mesh = 0; mesh < spheres.size(); ++mesh) {
      if (!is_target(scene, mesh)) continue;
      Beam beam{lamp, mesh, spheres[mesh]};
      for (int k = 0; k < kTracing.beam_pilots; ++k) {
        Sampler sampler(0, static_cast<std::uint32_t>(lamp), static_cast<std::uint32_t>(k));
        beam.power += luminance(emitted(scene.lamps[lamp], beam.sphere, sampler).power_W);
      }
      if (!(beam.power > 0)) continue;
      all += beam.power;
      beams.push_back(beam);
    }
  }
  for (Beam& beam : beams) {
    beam.photons = std::max(static_cast<int>(std::lround(static_cast<float>(count) * beam.power / all)),
                            kTracing.min_beam_photons);
  }
  return beams;
}

class PhotonPath {
 public:
  PhotonPath(const PhotonScene& scene, Sampler& sampler, std::vector<Photon>& landed)
      : scene_(scene), sampler_(sampler), landed_(landed) {}

  void follow(const Beam& beam) {
    const Emitted e = emitted(scene_.lamps[beam.lamp], beam.sphere, sampler_);
    if (!(e.power_W.maxCoeff() > 0)) return;
    power_W_ = e.power_W / static_cast<float>(beam.photons);
    w_ = e.w;
    from_m_ = e.from_m;
    // Of another object's sphere that this ray hits too, the photons are others.
    const auto hit = scene_.objects.hit(from_m_, w_, kFar);
    if (!hit || hit->mesh != beam.mesh) return;
    const SurfaceHit surface = scene_.objects.surface(*hit, w_);
    if (!sends_on(*hit, surface)) return;
    const float open = scene_.open(beam.lamp, ray_origin(surface, -w_), -w_, hit->t_m);
    if (!(open > 0)) return;
    power_W_ *= open;
    if (!leave(surface)) return;
    for (int bounce = 1; bounce < kTracing.max_photon_bounces; ++bounce) {
      if (!go_on()) return;
    }
  }

 private:
  static constexpr float kFar = std::numeric_limits<float>::infinity();

  /// To the next surface; false where the photon ends.
  bool go_on() {
    const auto room = scene_.real.hit(from_m_, w_, kFar);
    const auto object = scene_.objects.hit(from_m_, w_, room ? room->t_m : kFar);
    if (!room && !object) return false;
    const float t_m = object ? object->t_m : room->t_m;
    power_W_ *= (-absorption_ * t_m).exp();
    const auto lamp = nearest_lamp(scene_.lamps, from_m_, w_);
    if (lamp && lamp->t_m < t_m) return false;
    const SurfaceHit surface = object ? scene_.objects.surface(*object, w_) : scene_.real.surface(*room, w_);
    if (surface.bsdf.diffuse.maxCoeff() > 0 || !object)
      landed_.push_back({.position_m = surface.position_m, .normal = surface.face, .w = w_, .power_W = power_W_});
    return object && sends_on(*object, surface) && leave(surface);
  }

  bool sends_on(const MeshHit& object, const SurfaceHit& surface) const {
    return surface.bsdf.transmits() || (scene_.reflects && scene_.reflects(object));
  }

  /// By the interface of a surface that sends photons on.
  bool leave(SurfaceHit surface) {
    surface.bsdf.lobes = Lobes::interface;
    const PathVertex vertex(surface, w_);
    const Vector3f next = vertex.sample(sampler_);
    const float pdf = vertex.pdf(next);
    // Power, unlike radiance, is not changed by refraction (Veach 1997, eq. 5.14).
    const Rgb factor = vertex.response(next) * (vertex.squeezed(next) / std::max(pdf, kMinPdf));
    if (!(factor.maxCoeff() > 0 && factor.allFinite())) return false;
    share_ *= luminance(factor);
    power_W_ *= factor;
    if (share_ < kMinShare) {
      // Russian roulette. Earlier it would only make fewer photons of a coloured beam, and noise.
      if (!(sampler_.one() * kMinShare < share_)) return false;
      power_W_ *= kMinShare / share_;
      share_ = kMinShare;
    }
    absorption_ = vertex.absorption(next, absorption_);
    from_m_ = vertex.leave(next);
    w_ = next;
    return true;
  }

  static constexpr float kMinPdf = std::numeric_limits<float>::min(), kMinShare = 0.05f;

  const PhotonScene& scene_;
  Sampler& sampler_;
  std::vector<Photon>& landed_;
  Vector3f from_m_ = Vector3f::Zero(), w_ = Vector3f::UnitZ();
  Rgb power_W_ = Rgb::Zero(), absorption_ = Rgb::Zero();
  float share_ = 1;  ///< of its first power that interfaces left, without absorption
};

}  // namespace

bool has_photons(const PhotonScene& scene) {
  if (scene.lamps.empty()) return false;
  for (std::uint32_t mesh = 0; mesh < scene.objects.spheres().size(); ++mesh) {
    if (is_target(scene, mesh)) return true;
  }
  return false;
}

PhotonMap trace_photons(const PhotonScene& scene, int count, std::uint32_t seed) {
  std::vector<Photon> all;
  const std::vector<Beam> beams = beams_of(scene, count);
  for (std::size_t i = 0; i < beams.size(); ++i) {
    const Beam& beam = beams[i];
    const int blocks = (beam.photons + kTracing.photon_block - 1) / kTracing.photon_block;
    std::vector<std::vector<Photon>> of_block(static_cast<std::size_t>(blocks));
    for_each_index(of_block.size(), 1, [&](std::size_t block) {
      const int first = static_cast<int>(block) * kTracing.photon_block;
      for (int k = first; k < std::min(first + kTracing.photon_block, beam.photons); ++k) {
        Sampler sampler(seed, static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(k));
        PhotonPath(scene, sampler, of_block[block]).follow(beam);
      }
    });
    for (const std::vector<Photon>& landed : of_block) std::ranges::copy(landed, std::back_inserter(all));
  }
  return PhotonMap(std::move(all));
}

}  // namespace lumigraft::relight
