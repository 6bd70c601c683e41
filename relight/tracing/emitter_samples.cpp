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

constexpr std::size_t kPerSet = RayFan::kMaxRays, kAll = EmissiveSurface::kPatches;
constexpr std::uint32_t kEmitterSeed = 37;
constexpr float kRounding = 1e-5f;  // of the length of unit normals

/// The mean of every few of them.
std::vector<EmitterPoint> merged(const std::vector<EmitterPoint>& patches) {
  constexpr std::size_t kMerged = kTracing.merged_patches;
  std::vector<EmitterPoint> means;
  for (std::size_t i = 0; i < patches.size(); i += kMerged) {
    Vector3f position_m = Vector3f::Zero(), normal = position_m;
    Rgb power = Rgb::Zero();
    float area_m2 = 0;
    for (std::size_t k = i; k < i + kMerged; ++k) {
      position_m += patches[k].position_m / kMerged;
      normal += patches[k].normal / kMerged;
      power += patches[k].radiance / patches[k].pdf / kMerged;
      area_m2 += 1 / patches[k].pdf / kMerged;
    }
    means.push_back({position_m, normal, power / area_m2, 1 / area_m2});
  }
  return means;
}

}  // namespace

EmitterSampleSet::EmitterSampleSet(const Emitters& emitters, std::size_t mesh, std::uint32_t seed) {
  std::vector<Vector3f> positions_m;
  for (std::uint32_t k = 0; k < kSets * kPerSet; ++k) {
    // A Sobol' sequence: every set is stratified, and so is the whole.
    const EmitterPoint p = emitters.point(mesh, Sampler(seed, 0, k).two());
    points_.push_back(p);
    positions_m.push_back(p.position_m);
  }
  const BoundingSphere around = bounding_sphere(positions_m);
  centre_m_ = around.centre_m;
  reach_m_ = around.radius_m;
  patches_ = emitters.patches(mesh);
  merged_patches_ = merged(patches_);
}

float EmitterSampleSet::fraction_of_ray(float cosine, float point_pdf) {
  const float ray = kTracing.emission_rays * cosine / kPi;
  return ray > 0 ? balanced(ray, kAll * point_pdf) : 0;
}

template <typename Add>
void EmitterSampleSet::for_each(const SurfaceHit& surface, std::span<const EmitterPoint> points, Add add) {
  const Vector3f from_m = ray_origin(surface, surface.face);
  const float fewer = static_cast<float>(kAll) / static_cast<float>(points.size());
  for (std::size_t k = 0; k < points.size(); ++k) {
    const EmitterPoint& p = points[k];
    const Vector3f to = p.position_m - from_m;
    const float d2 = to.squaredNorm(), distance_m = std::sqrt(d2);
    // Cosines times the distance. What a patch lacks of a unit normal faces all directions: a quarter of its area in
    // the mean of them, as the rest does (Cauchy 1832).
    const float lacks = 1 - p.normal.norm(), all_ways = lacks > kRounding ? lacks / 4 * distance_m : 0;
    const float facing = std::max(-p.normal.dot(to), 0.0f) + all_ways, above = surface.normal.dot(to);
    if (!(facing > 0 && above > 0 && surface.face.dot(to) > 0)) continue;
    const float cosine = above / distance_m;
    const float per_sr = kAll * p.pdf * d2 * distance_m / facing;
    add(k, p, to, distance_m, fewer * cosine / (per_sr + kTracing.emission_rays * cosine / kPi));
  }
}

ShadowRayPacket EmitterSampleSet::from(const SurfaceHit& surface, int set) const {
  ShadowRayPacket fan;
  fan.rays.from_m = ray_origin(surface, surface.face);
  fan.weight.fill(0);
  for_each(surface, std::span(points_).subspan(static_cast<std::size_t>(set) * kPerSet, kPerSet),
           [&](std::size_t k, const EmitterPoint& p, const Vector3f& to, float distance_m, float gain) {
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
  const bool near =
      (surface.position_m - centre_m_).squaredNorm() < kTracing.near_radii * kTracing.near_radii * reach_m_ * reach_m_;
  Rgb sum = Rgb::Zero();
  for_each(surface, near ? patches_ : merged_patches_,
           [&](std::size_t, const EmitterPoint& p, const Vector3f&, float, float gain) { sum += p.radiance * gain; });
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
