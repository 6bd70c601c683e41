#include "relight/reference/delta_path_tracer.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <functional>
#include <thread>
#include <vector>

#include "relight/reference/paths.h"

namespace lumigraft {
namespace {

using reference::Paths;
using reference::Ray;
using reference::Sampler;

constexpr int kTile_px = 16;

/// Calls `pixel(u, v)` once for each, on several threads, in any order.
void for_each_pixel(int width, int height, int threads, const std::function<void(int, int)>& pixel) {
  const int across = (width + kTile_px - 1) / kTile_px, tiles = across * ((height + kTile_px - 1) / kTile_px);
  std::atomic<int> next = 0;
  const auto work = [&] {
    for (int tile = next++; tile < tiles; tile = next++) {
      const int left = tile % across * kTile_px, top = tile / across * kTile_px;
      for (int v = top; v < std::min(top + kTile_px, height); ++v) {
        for (int u = left; u < std::min(left + kTile_px, width); ++u) pixel(u, v);
      }
    }
  };
  const int wanted = threads > 0 ? threads : static_cast<int>(std::max(std::thread::hardware_concurrency(), 1u));
  std::vector<std::thread> others;
  for (int i = 1; i < std::min(wanted, tiles); ++i) others.emplace_back(work);
  work();
  for (std::thread& other : others) other.join();
}

/// Through a point of the pixel's square, if the camera has a ray there.
std::optional<Ray> camera_ray(const ReferenceCamera& camera, int u, int v, Sampler& sampler) {
  const Eigen::Vector2f within = sampler.two();
  const auto w = camera.model.unproject({u + within.x() - 0.5, v + within.y() - 0.5});
  if (!w) return std::nullopt;
  return Ray{camera.T_tag_camera.translation(), (camera.T_tag_camera.linear() * w->cast<float>()).normalized()};
}

/// The mean over the samples of `sample(ray, paths)`, a list of numbers.
template <std::size_t N, typename Sample>
std::array<float, N> mean_over_pixel(const reference::World& world, const ReferenceCamera& camera,
                                     const ReferenceSamples& samples, int u, int v, Sample sample) {
  std::array<double, N> sum{};
  for (int i = 0; i < samples.per_pixel; ++i) {
    Sampler sampler(samples.seed, static_cast<std::uint32_t>(v * camera.model.width + u),
                    static_cast<std::uint32_t>(i));
    const std::optional<Ray> ray = camera_ray(camera, u, v, sampler);
    if (!ray) continue;
    Paths paths(world, sampler);
    const std::array<float, N> values = sample(*ray, paths);
    for (std::size_t n = 0; n < N; ++n) sum[n] += values[n];
  }
  std::array<float, N> mean{};
  for (std::size_t n = 0; n < N; ++n) mean[n] = static_cast<float>(sum[n] / samples.per_pixel);
  return mean;
}

}  // namespace

struct DeltaPathTracer::State {
  reference::World world;
};

DeltaPathTracer::DeltaPathTracer(std::shared_ptr<const ReferenceScene> scene)
    : state_(new State{reference::World(std::move(scene))}) {}
DeltaPathTracer::~DeltaPathTracer() = default;

ReferencePicture DeltaPathTracer::change(const ReferenceCamera& camera, const ReferenceSamples& samples) const {
  const int width = camera.model.width, height = camera.model.height;
  ReferencePicture picture{Image<float>(width, height, 3), Image<float>(width, height, 3),
                           Image<float>(width, height, 1)};
  for_each_pixel(width, height, samples.threads, [&](int u, int v) {
    const auto mean = mean_over_pixel<7>(state_->world, camera, samples, u, v, [](const Ray& ray, Paths& paths) {
      const reference::CameraSample s = paths.change(ray);
      std::array<float, 7> values{};
      std::copy_n(s.light.data(), 3, values.begin() + (s.on_object ? 3 : 0));
      values[6] = s.on_object ? 1.0f : 0.0f;
      return values;
    });
    std::copy_n(mean.begin(), 3, &picture.change.at(u, v, 0));
    std::copy_n(mean.begin() + 3, 3, &picture.object.at(u, v, 0));
    picture.coverage.at(u, v) = mean[6];
  });
  return picture;
}

Image<float> DeltaPathTracer::radiance(const ReferenceCamera& camera, const ReferenceSamples& samples,
                                       bool with_objects) const {
  Image<float> picture(camera.model.width, camera.model.height, 3);
  for_each_pixel(picture.width, picture.height, samples.threads, [&](int u, int v) {
    const auto mean =
        mean_over_pixel<3>(state_->world, camera, samples, u, v, [with_objects](const Ray& ray, Paths& paths) {
          const Rgb light = paths.radiance(ray, with_objects);
          return std::array<float, 3>{light[0], light[1], light[2]};
        });
    std::copy_n(mean.begin(), 3, &picture.at(u, v, 0));
  });
  return picture;
}

}  // namespace lumigraft
