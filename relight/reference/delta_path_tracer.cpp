#include "relight/reference/delta_path_tracer.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "relight/reference/parameters.h"
#include "relight/reference/paths.h"
#include "relight/tracing/parallel_for.h"
#include "relight/tracing/photon_tracing.h"

namespace lumigraft::relight {
namespace {

constexpr std::uint32_t kPhotonSeed = 51;

/// Ray through a point of the pixel's square, if the camera has a ray there.
std::optional<PathRay> camera_ray(const PosedCamera& camera, int u, int v, Sampler& sampler) {
  const Eigen::Vector2f within = sampler.two();
  const auto w = camera.model.unproject({u + within.x() - 0.5, v + within.y() - 0.5});
  if (!w) return std::nullopt;
  return PathRay{camera.T_tag_camera.translation(), (camera.T_tag_camera.linear() * w->cast<float>()).normalized()};
}

/// Calls `sample(ray, paths)` for samples of a pixel.
template <typename Sample>
void for_each_sample(const TraceWorld& world, const PhotonMap* photons, const PosedCamera& camera, std::uint32_t seed,
                     int count, int u, int v, Sample sample) {
  for (int i = 0; i < count; ++i) {
    Sampler sampler(seed, static_cast<std::uint32_t>(v * camera.model.width + u), static_cast<std::uint32_t>(i));
    const std::optional<PathRay> ray = camera_ray(camera, u, v, sampler);
    if (!ray) continue;
    Paths paths(world, sampler, photons);
    sample(*ray, paths);
  }
}

/// Adaptive sample counts that minimise the image's error for `per_pixel` on average: proportional to the standard
/// deviation of a sample in the neighbourhood, estimated by pilot samples. These are not reused, so that counts and
/// values are independent and the result is unbiased.
std::vector<int> sample_counts(const TraceWorld& world, const PhotonMap* photons, const PosedCamera& camera,
                               const ReferenceSamples& samples) {
  const int width = camera.model.width, height = camera.model.height, pilot = samples.per_pixel / kPaths.per_pilot;
  std::vector<int> counts(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), samples.per_pixel);
  if (pilot < kPaths.min_pilot) return counts;
  capture::Image<double> variance(width, height, 1);
  for_each_pixel(width, height, 1, [&](int u, int v) {
    double sum = 0, sum2 = 0;
    for_each_sample(world, photons, camera, ~samples.seed, pilot, u, v, [&](const PathRay& ray, Paths& paths) {
      const CameraSample s = paths.change(ray);
      const double light = (s.on_object ? kPaths.object_weight : 1) * luminance(s.light);
      sum += light;
      sum2 += light * light;
    });
    variance.at(u, v) = std::max(sum2 - sum * sum / pilot, 0.0);
  });
  std::vector<double> deviation(counts.size());
  double total = 0;
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      double sum = 0;
      int pixels = 0;
      for (int y = std::max(v - kPaths.near_px, 0); y <= std::min(v + kPaths.near_px, height - 1); ++y) {
        for (int x = std::max(u - kPaths.near_px, 0); x <= std::min(u + kPaths.near_px, width - 1); ++x, ++pixels) {
          sum += variance.at(x, y);
        }
      }
      total += deviation[variance.index(u, v)] = std::sqrt(sum / pixels);
    }
  }
  const double mean = total / static_cast<double>(counts.size());
  if (!(mean > 0)) return counts;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const double ratio = std::clamp<double>(deviation[i] / mean, 1.0 / kPaths.max_fall, kPaths.max_rise);
    counts[i] = std::max(static_cast<int>(std::lround(ratio * samples.per_pixel)), 1);
  }
  return counts;
}

std::unique_ptr<const PhotonMap> photons_of(const TraceWorld& world) {
  const std::vector<ReferenceLamp>& lamps = world.scene->lamps;
  const PhotonScene scene{
      world.real, world.objects, lamps, [&](std::size_t lamp, const auto& p_m, const auto& w, float distance_m) {
        const float limit_m = distance_m - kTracing.before_lamp_m;
        return world.real.blocked(p_m, w, limit_m) || behind_other_lamp(lamps, lamp, p_m, w, limit_m)
                   ? 0.0f
                   : world.open(lamp, p_m);
      }};
  if (!has_photons(scene)) return nullptr;
  return std::make_unique<const PhotonMap>(trace_photons(scene, kPaths.photons, kPhotonSeed));
}

}  // namespace

DeltaPathTracer::DeltaPathTracer(std::shared_ptr<const ReferenceScene> scene)
    : world_(std::make_unique<const TraceWorld>(std::move(scene))), photons_(photons_of(*world_)) {}
DeltaPathTracer::~DeltaPathTracer() = default;

ReferencePicture DeltaPathTracer::change(const PosedCamera& camera, const ReferenceSamples& samples) const {
  const int width = camera.model.width, height = camera.model.height;
  ReferencePicture picture{capture::Image<float>(width, height, 3),
                           capture::Image<float>(width, height, 3),
                           capture::Image<float>(width, height, 1),
                           {},
                           {},
                           {}};
  if (samples.unhidden) {
    picture.unhidden_object = picture.object;
    picture.unhidden_coverage = picture.distance_m = picture.coverage;
  }
  const std::vector<int> counts = sample_counts(*world_, photons_.get(), camera, samples);
  for_each_pixel(width, height, 1, [&](int u, int v) {
    const int count = counts[picture.coverage.index(u, v)];
    Eigen::Array3d change = Eigen::Array3d::Zero(), object = change, hidden = change;
    int covered = 0, behind = 0;
    double distance_m = 0;
    for_each_sample(*world_, photons_.get(), camera, samples.seed, count, u, v, [&](const PathRay& ray, Paths& paths) {
      const CameraSample s = paths.change(ray);
      (s.on_object ? object : change) += s.light.cast<double>();
      covered += s.on_object ? 1 : 0;
      distance_m += static_cast<double>(s.object_m);
      if (s.on_object || !samples.unhidden) return;
      if (const std::optional<CameraSample> h = paths.hidden_object(ray)) {
        hidden += h->light.cast<double>();
        distance_m += static_cast<double>(h->object_m);
        ++behind;
      }
    });
    for (int c = 0; c < 3; ++c) {
      picture.change.at(u, v, c) = static_cast<float>(change[c] / count);
      picture.object.at(u, v, c) = static_cast<float>(object[c] / count);
    }
    picture.coverage.at(u, v) = static_cast<float>(covered) / static_cast<float>(count);
    if (!samples.unhidden || covered + behind == 0) return;
    for (int c = 0; c < 3; ++c) picture.unhidden_object.at(u, v, c) = static_cast<float>((object + hidden)[c] / count);
    picture.unhidden_coverage.at(u, v) = static_cast<float>(covered + behind) / static_cast<float>(count);
    picture.distance_m.at(u, v) = static_cast<float>(distance_m / (covered + behind));
  });
  return picture;
}

capture::Image<float> DeltaPathTracer::radiance(const PosedCamera& camera, const ReferenceSamples& samples,
                                                bool with_objects) const {
  capture::Image<float> picture(camera.model.width, camera.model.height, 3);
  for_each_pixel(picture.width, picture.height, 1, [&](int u, int v) {
    Eigen::Array3d sum = Eigen::Array3d::Zero();
    for_each_sample(*world_, nullptr, camera, samples.seed, samples.per_pixel, u, v,
                    [&](const PathRay& ray, Paths& paths) { sum += paths.radiance(ray, with_objects).cast<double>(); });
    for (int c = 0; c < 3; ++c) picture.at(u, v, c) = static_cast<float>(sum[c] / samples.per_pixel);
  });
  return picture;
}

}  // namespace lumigraft::relight
