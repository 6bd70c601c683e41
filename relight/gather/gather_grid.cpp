#include "relight/gather/gather_grid.h"

#include <algorithm>
#include <cmath>

#include "relight/gather/parameters.h"
#include "relight/tracing/fast_exp.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

float alike(const SurfaceHit& a, const SurfaceHit& b, float pixel_m, float near_m) {
  const Vector3f apart = b.position_m - a.position_m;
  const float turn = std::max(a.normal.dot(b.normal), 0.0f), off = a.normal.dot(apart) / (kGather.off_px * pixel_m);
  const float far2 = apart.squaredNorm() / (near_m * near_m);
  return pow32(turn) * fast_exp(off * off + far2);
}

}  // namespace

GatherGrid::GatherGrid(const std::vector<GBufferPixel>& seen, const capture::CameraModel& camera, int scale, Of kind)
    : seen_(seen),
      camera_(camera),
      scale_(scale),
      kind_(kind),
      width_((camera.width + scale - 1) / scale),
      height_((camera.height + scale - 1) / scale),
      cells_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_)),
      weights_(seen.size()) {
  for_each_pixel(width_, height_, kRows, [&](int x, int y) { choose_pixel(x, y); });
  for_each_pixel(camera_.width, camera_.height, kRows, [&](int u, int v) {
    const auto pixel = static_cast<std::size_t>(v * camera_.width + u);
    if (is_meant(seen_[pixel])) weights_[pixel] = weights_around(u, v, seen_[pixel].surface);
  });
}

void GatherGrid::choose_pixel(int x, int y) {
  Cell& cell = cells_[at(x, y)];
  cell.pixel = central_pixel(seen_, camera_, scale_, x, y, [&](const GBufferPixel& p) { return is_meant(p); });
  if (cell.pixel < 0) return;
  const float depth_m = seen_[static_cast<std::size_t>(cell.pixel)].depth_m;
  cell.pixel_m = static_cast<float>(scale_) * depth_m / static_cast<float>(camera_.fx);
}

std::array<float, 9> GatherGrid::weights_around(int u, int v, const SurfaceHit& own) const {
  std::array<float, 9> weights{};
  float sum = 0;
  for (int j = -1; j <= 1; ++j) {
    for (int i = -1; i <= 1; ++i) {
      const int x = u / scale_ + i, y = v / scale_ + j;
      if (x < 0 || y < 0 || x >= width_ || y >= height_) continue;
      const Cell& cell = cells_[at(x, y)];
      if (cell.pixel < 0) continue;
      const float du = static_cast<float>(cell.pixel % camera_.width - u) / static_cast<float>(scale_),
                  dv = static_cast<float>(cell.pixel / camera_.width - v) / static_cast<float>(scale_);
      float& weight = weights[static_cast<std::size_t>(3 * (j + 1) + i + 1)];
      weight = fast_exp(2 * (du * du + dv * dv)) *
                   alike(own, surface(cell), cell.pixel_m, std::numeric_limits<float>::infinity()) +
               1e-8f;
      sum += weight;
    }
  }
  if (sum > 0) {
    for (float& weight : weights) weight /= sum;
  }
  return weights;
}

void GatherGrid::gather(const DeltaLight& light, const std::vector<ChangeRegion>& places, int rays, float step_radiance,
                        std::uint32_t seed, const UpdateSubset& turn) {
  const auto irradiance = [&](std::uint32_t cell, const PathVertex& vertex, float* near_m) {
    // Most rays over the hemisphere; a few towards objects and shadows, which these may miss.
    const RayCounts counts{std::max(3 * rays / 5, 1), std::max(rays / 4, 1)};
    return changed_irradiance(light, vertex, counts, seed, cell, near_m);
  };
  const auto radiance = [&](std::uint32_t cell, const PathVertex& vertex, float* near_m) -> Rgb {
    const int at_once = std::max(rays / 2, 2), at_most = kGather.gloss_rounds * at_once;
    Rgb sum = Rgb::Zero(), squares = Rgb::Zero();
    for (int samples = 1;; ++samples) {
      Sampler sampler(seed, cell, static_cast<std::uint32_t>(samples - 1));
      const Rgb found = changed_radiance(light, vertex, sampler, near_m);
      sum += found;
      squares += found.square();
      if (samples % at_once != 0) continue;
      const auto n = static_cast<float>(samples);
      const Rgb mean = sum / n, variance_of_mean = (squares / n - mean.square()) / (n - 1);
      if (samples >= at_most || variance_of_mean.maxCoeff() <= step_radiance * step_radiance) return mean;
    }
  };
  for_each_index(static_cast<int>(cells_.size()), 32, [&](int i) {
    Cell& cell = cells_[static_cast<std::size_t>(i)];
    if (cell.pixel < 0 || !turn.is_of(4 * (i / width_ % 2) + i % width_ % 4)) return;
    const GBufferPixel& pixel = seen_[static_cast<std::size_t>(cell.pixel)];
    const bool glossy = kind_ == Of::glossy;
    PathVertex vertex(glossy ? pixel.surface : white_surface(pixel.surface), pixel.w);
    vertex.aim_at(places);
    cell.near_m = std::numeric_limits<float>::infinity();
    const auto number = static_cast<std::uint32_t>(i);
    cell.light = glossy ? radiance(number, vertex, &cell.near_m) : irradiance(number, vertex, &cell.near_m);
    // The width of a GGX lobe is about its alpha.
    cell.near_m *= glossy ? std::min(pixel.surface.bsdf.alpha, kGather.near_fraction) : kGather.near_fraction;
  });
}

std::vector<Eigen::Array4f> GatherGrid::smoothed() const {
  constexpr std::array<float, 3> kernel = {3.0f / 8, 1.0f / 4, 1.0f / 16};
  std::vector<Eigen::Array4f> light;
  for (const Cell& cell : cells_) light.emplace_back(cell.light[0], cell.light[1], cell.light[2], 0);
  for (int step = 0; step < kGather.filter_steps; ++step) {
    const std::vector<Eigen::Array4f> from = light;
    for_each_pixel(width_, height_, kRows, [&](int x, int y) {
      const Cell& cell = cells_[at(x, y)];
      if (cell.pixel < 0) return;
      Eigen::Array4f sum = Eigen::Array4f::Zero();
      float weights = 0;
      for (int j = -2; j <= 2; ++j) {
        for (int i = -2; i <= 2; ++i) {
          const int u = x + (i << step), v = y + (j << step);
          if (u < 0 || v < 0 || u >= width_ || v >= height_) continue;
          const Cell& other = cells_[at(u, v)];
          if (other.pixel < 0) continue;
          const float w = kernel[static_cast<std::size_t>(std::abs(i))] *
                          kernel[static_cast<std::size_t>(std::abs(j))] *
                          alike(surface(cell), surface(other), cell.pixel_m * static_cast<float>(1 << step),
                                std::min(cell.near_m, other.near_m));
          sum += w * from[at(u, v)];
          weights += w;
        }
      }
      if (weights > 0) light[at(x, y)] = sum / weights;
    });
  }
  return light;
}

std::vector<Eigen::Array4f> GatherGrid::at_pixels() const {
  const std::vector<Eigen::Array4f> light = smoothed();
  std::vector<Eigen::Array4f> pixels(seen_.size(), Eigen::Array4f::Zero());
  for_each_pixel(camera_.width, camera_.height, kRows, [&](int u, int v) {
    const auto pixel = static_cast<std::size_t>(v * camera_.width + u);
    if (!is_meant(seen_[pixel])) return;
    for (std::size_t k = 0; k < 9; ++k) {
      const float weight = weights_[pixel][k];
      if (weight <= 0) continue;
      const int x = u / scale_ + static_cast<int>(k % 3) - 1, y = v / scale_ + static_cast<int>(k / 3) - 1;
      pixels[pixel] += weight * light[at(x, y)];
    }
  });
  return pixels;
}

}  // namespace lumigraft::relight
