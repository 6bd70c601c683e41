#include "relight/rays/gather_grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "relight/rays/falloff.h"
#include "relight/rays/threads.h"

namespace lumigraft::rays {
namespace {

using Eigen::Vector3f;
using reference::Sampler;
using reference::Vertex;

constexpr int kSteps = 2;             // of the filter: one pixel apart, then two
constexpr float kOffPlane_px = 1.5f;  // as far from the other's plane as a surface goes on
constexpr float kNearShare = 0.5f;    // of the distance to an object: so far its light changes little

struct Cell {
  int pixel = -1;                                         ///< that it was gathered for
  float near_m = std::numeric_limits<float>::infinity();  ///< within which its light changes little
  float pixel_m = 0;                                      ///< how much of the surface's depth a pixel of the grid spans
  Rgb light = Rgb::Zero();
};

class Grid {
 public:
  Grid(const std::vector<PixelSurface>& seen, const CameraModel& camera, int scale, bool glossy)
      : seen_(seen),
        camera_(camera),
        scale_(scale),
        glossy_(glossy),
        width_((camera.width + scale - 1) / scale),
        height_((camera.height + scale - 1) / scale),
        cells_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_)) {
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) choose_pixel(x, y);
    }
  }

  /// `light(cell, vertex, near)` is a pixel's light, and lowers `near` to the nearest object.
  template <typename Light>
  void gather(const std::vector<reference::Place>& places, Light light) {
    for_each_block(static_cast<int>(cells_.size()), 32, [&](int first, int last) {
      for (int i = first; i < last; ++i) {
        Cell& cell = cells_[static_cast<std::size_t>(i)];
        if (cell.pixel < 0) continue;
        const PixelSurface& pixel = seen_[static_cast<std::size_t>(cell.pixel)];
        Vertex vertex(glossy_ ? pixel.surface : white_surface(pixel.surface), pixel.w);
        vertex.look_for(places);
        cell.light = light(static_cast<std::uint32_t>(i), vertex, &cell.near_m);
        // A lobe of GGX is about as wide as its alpha.
        cell.near_m *= glossy_ ? std::min(pixel.surface.look.alpha, kNearShare) : kNearShare;
      }
    });
  }

  void smooth() {
    constexpr std::array<float, 3> kernel = {3.0f / 8, 1.0f / 4, 1.0f / 16};
    for (int step = 0; step < kSteps; ++step) {
      const std::vector<Cell> from = cells_;
      for_each_block(height_, 4, [&](int first, int last) {
        for (int y = first; y < last; ++y) {
          for (int x = 0; x < width_; ++x) {
            Cell& cell = cells_[at(x, y)];
            if (cell.pixel < 0) continue;
            Rgb sum = Rgb::Zero();
            float weights = 0;
            for (int j = -2; j <= 2; ++j) {
              for (int i = -2; i <= 2; ++i) {
                const int u = x + (i << step), v = y + (j << step);
                if (u < 0 || v < 0 || u >= width_ || v >= height_) continue;
                const Cell& other = from[at(u, v)];
                if (other.pixel < 0) continue;
                const float w = kernel[static_cast<std::size_t>(std::abs(i))] *
                                kernel[static_cast<std::size_t>(std::abs(j))] *
                                alike(surface(cell), surface(other), cell.pixel_m * static_cast<float>(1 << step),
                                      std::min(cell.near_m, other.near_m));
                sum += w * other.light;
                weights += w;
              }
            }
            if (weights > 0) cell.light = sum / weights;
          }
        }
      });
    }
  }

  std::vector<Rgb> upsampled() const {
    std::vector<Rgb> pixels(seen_.size(), Rgb::Zero());
    for_each_block(camera_.height, 4, [&](int first, int last) {
      for (int v = first; v < last; ++v) {
        for (int u = 0; u < camera_.width; ++u) {
          const std::size_t pixel =
              static_cast<std::size_t>(v) * static_cast<std::size_t>(camera_.width) + static_cast<std::size_t>(u);
          if (seen_[pixel].known && seen_[pixel].glossy == glossy_)
            pixels[pixel] = at_pixel(u, v, seen_[pixel].surface);
        }
      }
    });
    return pixels;
  }

 private:
  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }
  const reference::Surface& surface(const Cell& cell) const {
    return seen_[static_cast<std::size_t>(cell.pixel)].surface;
  }

  /// The block's pixel nearest to its middle that shows an even surface.
  void choose_pixel(int x, int y) {
    Cell& cell = cells_[at(x, y)];
    float least = std::numeric_limits<float>::infinity();
    for (int v = y * scale_; v < std::min((y + 1) * scale_, camera_.height); ++v) {
      for (int u = x * scale_; u < std::min((x + 1) * scale_, camera_.width); ++u) {
        const int pixel = v * camera_.width + u;
        const PixelSurface& p = seen_[static_cast<std::size_t>(pixel)];
        const float off = std::hypot(static_cast<float>(u - x * scale_) - 0.4f * static_cast<float>(scale_),
                                     static_cast<float>(v - y * scale_) - 0.4f * static_cast<float>(scale_));
        if (!p.known || p.glossy != glossy_ || off >= least) continue;
        least = off;
        cell.pixel = pixel;
        cell.pixel_m = static_cast<float>(scale_) * p.depth_m / static_cast<float>(camera_.fx);
      }
    }
  }

  static float alike(const reference::Surface& a, const reference::Surface& b, float pixel_m, float near_m) {
    const Vector3f apart = b.position_m - a.position_m;
    const float turn = std::max(a.normal.dot(b.normal), 0.0f), off = a.normal.dot(apart) / (kOffPlane_px * pixel_m);
    const float far2 = apart.squaredNorm() / (near_m * near_m);
    return to_the_32nd(turn) * falloff(off * off + far2);
  }

  Rgb at_pixel(int u, int v, const reference::Surface& own) const {
    Rgb sum = Rgb::Zero();
    float weights = 0;
    for (int j = -1; j <= 1; ++j) {
      for (int i = -1; i <= 1; ++i) {
        const int x = u / scale_ + i, y = v / scale_ + j;
        if (x < 0 || y < 0 || x >= width_ || y >= height_) continue;
        const Cell& cell = cells_[at(x, y)];
        if (cell.pixel < 0) continue;
        const float du = static_cast<float>(cell.pixel % camera_.width - u) / static_cast<float>(scale_),
                    dv = static_cast<float>(cell.pixel / camera_.width - v) / static_cast<float>(scale_);
        const float w = falloff(2 * (du * du + dv * dv)) *
                            alike(own, surface(cell), cell.pixel_m, std::numeric_limits<float>::infinity()) +
                        1e-8f;
        sum += w * cell.light;
        weights += w;
      }
    }
    return weights > 0 ? (sum / weights).eval() : sum;
  }

  const std::vector<PixelSurface>& seen_;
  const CameraModel& camera_;
  int scale_;
  bool glossy_;
  int width_, height_;
  std::vector<Cell> cells_;
};

}  // namespace

std::vector<Rgb> gather_pixels(const DeltaLight& light, const std::vector<reference::Place>& places,
                               const std::vector<PixelSurface>& seen, const CameraModel& camera,
                               const GatherSettings& settings) {
  Grid grid(seen, camera, settings.scale, false);
  // Most of what changes comes from all around, a little from objects and shadows that rays may miss.
  const RayCounts rays{std::max(3 * settings.rays / 5, 1), std::max(settings.rays / 4, 1)};
  grid.gather(places, [&](std::uint32_t cell, const Vertex& vertex, float* near_m) {
    return changed_irradiance(light, vertex, rays, settings.seed, cell, near_m);
  });
  grid.smooth();
  return grid.upsampled();
}

std::vector<Rgb> gather_gloss(const DeltaLight& light, const std::vector<reference::Place>& places,
                              const std::vector<PixelSurface>& seen, const CameraModel& camera,
                              const GatherSettings& settings) {
  Grid grid(seen, camera, settings.scale, true);
  grid.gather(places, [&](std::uint32_t cell, const Vertex& vertex, float* near_m) {
    Rgb sum = Rgb::Zero();
    const int rays = std::max(settings.rays / 2, 1);
    for (int k = 0; k < rays; ++k) {
      Sampler sampler(settings.seed, cell, static_cast<std::uint32_t>(k));
      sum += changed_radiance(light, vertex, sampler, near_m);
    }
    return (sum / static_cast<float>(rays)).eval();
  });
  grid.smooth();
  return grid.upsampled();
}

}  // namespace lumigraft::rays
