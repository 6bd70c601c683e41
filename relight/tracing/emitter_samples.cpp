#include "relight/tracing/emitter_samples.h"

#include <algorithm>
#include <cmath>

#include "relight/objects/placement.h"
#include "relight/tracing/bsdf.h"
#include "relight/tracing/sampler.h"
#include "relight/tracing/vertex.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

constexpr std::size_t kPerSet = RayFan::kMaxRays, kAll = LightSource::kSets * kPerSet;
constexpr float kRays = 16;  // over the hemisphere: other numbers of them are weighted as these
constexpr float kNear = 6;   // radii; within them light is the sum of all points, beyond of one set: 1 % off
constexpr std::uint32_t kEmitterSeed = 37;

}  // namespace

EmitterSampleSet::EmitterSampleSet(const Emitters& emitters, std::size_t mesh, std::uint32_t seed) {
  std::vector<Vector3f> positions_m;
  for (std::uint32_t k = 0; k < kAll; ++k) {
    // A Sobol' sequence: every set is stratified, and so is the whole.
    const EmitterPoint p = emitters.point(mesh, Sampler(seed, 0, k).two());
    points_.push_back({p.position_m, p.normal, p.radiance, p.pdf});
    positions_m.push_back(p.position_m);
  }
  const BoundingSphere around = bounding_sphere(positions_m);
  centre_m_ = around.centre_m;
  reach_m_ = around.radius_m;
}

float EmitterSampleSet::share_of_ray(float cosine, float point_pdf) {
  const float ray = kRays * cosine / kPi;
  return ray > 0 ? balanced(ray, kAll * point_pdf) : 0;
}

template <typename Add>
void EmitterSampleSet::for_each(const SurfaceHit& surface, std::size_t first, std::size_t count, Add add) const {
  const Vector3f from_m = ray_origin(surface, surface.face);
  for (std::size_t k = 0; k < count; ++k) {
    const Point& p = points_[first + k];
    const Vector3f to = p.position_m - from_m;
    const float facing = -p.normal.dot(to), above = surface.normal.dot(to);  // cosines times the distance
    if (!(facing > 0 && above > 0 && surface.face.dot(to) > 0)) continue;
    const float d2 = to.squaredNorm(), distance_m = std::sqrt(d2), cosine = above / distance_m;
    const float points = kAll * p.pdf * d2 * distance_m / facing;  // per solid angle
    const float fewer = static_cast<float>(kAll) / static_cast<float>(count);
    add(k, p, to, distance_m, fewer * cosine / (points + kRays * cosine / kPi));
  }
}

ShadowRayPacket EmitterSampleSet::from(const SurfaceHit& surface, int set) const {
  ShadowRayPacket fan;
  fan.rays.from_m = ray_origin(surface, surface.face);
  fan.weight.fill(0);
  for_each(surface, static_cast<std::size_t>(set) * kPerSet, kPerSet,
           [&](std::size_t k, const Point& p, const Vector3f& to, float distance_m, float gain) {
             fan.weight[k] = luminance(p.radiance) * gain;
             if (!(fan.weight[k] > 0)) return;
             fan.all += fan.weight[k];
             fan.rays.some |= 1u << k;
             fan.rays.w[k] = to / distance_m;
             fan.rays.limit_m[k] = std::max(distance_m - kTracing.before_lamp_m, 0.0f);
           });
  return fan;
}

Rgb EmitterSampleSet::irradiance(const SurfaceHit& surface) const {
  const bool near = (surface.position_m - centre_m_).squaredNorm() < kNear * kNear * reach_m_ * reach_m_;
  Rgb sum = Rgb::Zero();
  for_each(surface, 0, near ? points_.size() : kPerSet,
           [&](std::size_t, const Point& p, const Vector3f&, float, float gain) { sum += p.radiance * gain; });
  return sum;
}

std::vector<EmitterSampleSet> emitter_samples_of(const Emitters& emitters) {
  std::vector<EmitterSampleSet> sets;
  for (std::size_t mesh = 0; mesh < emitters.meshes(); ++mesh) {
    if (emitters.emits(mesh)) sets.emplace_back(emitters, mesh, kEmitterSeed + static_cast<std::uint32_t>(mesh));
  }
  return sets;
}

}  // namespace lumigraft::relight
