#include "relight/rays/ray_shadows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "relight/rays/threads.h"

namespace lumigraft::rays {
namespace {

using Eigen::Vector3f;
using reference::Sampler;
using reference::Vertex;

constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr float kOfPenumbra = 0.35f;  // standard deviation of the smoothing
constexpr float kOffPlane_px = 1.5f;
constexpr float kWide_px = 4;  // penumbra that is the same all over a pixel
constexpr int kRow = 4;        // rows of pixels, a thread's turn

struct Shadow {
  Rgb value = Rgb::Zero();
  float penumbra_m = kFar;  ///< how wide the narrowest penumbra is that falls here
};

class LampShadow {
 public:
  LampShadow(const DeltaLight& light, std::size_t lamp, const std::vector<PixelSurface>& seen,
             const CameraModel& camera)
      : light_(light),
        lamp_(light.room().lamps()[lamp]),
        number_(lamp),
        seen_(seen),
        width_(camera.width),
        height_(camera.height),
        focal_px_(static_cast<float>(camera.fx)),
        shadows_(seen.size()) {}

  /// `wanted(pixel)`: else the pixel keeps zero. `take(sum, all, point)` adds to the sum and to what it is a share of;
  /// `share` says whether that is one, or a mean.
  template <typename Wanted, typename Take>
  void sample(int samples, bool share, Wanted wanted, Take take) {
    for_each_block(height_, kRow, [&](int first, int last) {
      for (int v = first; v < last; ++v) {
        for (int u = 0; u < width_; ++u) {
          const PixelSurface& p = seen_[at(u, v)];
          if (!p.known || !wanted(p)) continue;
          Shadow& shadow = shadows_[at(u, v)];
          const Vertex vertex(white_surface(p.surface), p.w);
          const int place = 4 * (v & 3) + (u & 3);
          Rgb all = Rgb::Zero();
          for (int k = 0; k < samples; ++k) {
            Sampler sampler(static_cast<std::uint32_t>(number_), 0, static_cast<std::uint32_t>(place * samples + k));
            const DeltaLight::LampPoint point = light_.lamp_point(vertex, number_, sampler.two());
            take(shadow.value, all, point);
            if (point.to_object_m == kFar) continue;
            const float beyond_m = std::max((lamp_.centre_m - p.surface.position_m).norm() - point.to_object_m, 1e-3f);
            shadow.penumbra_m =
                std::min(shadow.penumbra_m, 2 * reference::lamp_reach_m(lamp_) * point.to_object_m / beyond_m);
          }
          if (share) {
            shadow.value.setConstant(all.sum() > 0 ? shadow.value.sum() / all.sum() : 1.0f);
          } else {
            shadow.value *= reference::kPi / static_cast<float>(samples);
          }
        }
      }
    });
  }

  /// `add(pixel, value, narrowest penumbra around over a pixel's width)` for every pixel with a surface. `sharp_turn`:
  /// power of the cosine between normals.
  template <typename Add>
  void smoothed(float sharp_turn, Add add) const {
    constexpr std::array<float, 3> kernel = {3.0f / 8, 1.0f / 4, 1.0f / 16};
    for_each_block(height_, kRow, [&](int first, int last) {
      for (int v = first; v < last; ++v) {
        for (int u = 0; u < width_; ++u) {
          const PixelSurface& own = seen_[at(u, v)];
          if (!own.known) continue;
          const float pixel_m = own.depth_m / focal_px_;
          Rgb mean = Rgb::Zero();
          float weights = 0, narrowest_m = kFar;
          for (int y = std::max(v - 2, 0); y <= std::min(v + 2, height_ - 1); ++y) {
            for (int x = std::max(u - 2, 0); x <= std::min(u + 2, width_ - 1); ++x) {
              const PixelSurface& other = seen_[at(x, y)];
              if (!other.known) continue;
              narrowest_m = std::min(narrowest_m, shadows_[at(x, y)].penumbra_m);
              const Vector3f apart = other.surface.position_m - own.surface.position_m;
              const float within_m =
                  kOfPenumbra * std::min(shadows_[at(u, v)].penumbra_m, shadows_[at(x, y)].penumbra_m);
              const float off = own.surface.normal.dot(apart) / (kOffPlane_px * pixel_m);
              const float turn = std::max(own.surface.normal.dot(other.surface.normal), 0.0f);
              const float w = kernel[static_cast<std::size_t>(std::abs(x - u))] *
                              kernel[static_cast<std::size_t>(std::abs(y - v))] * std::pow(turn, sharp_turn) *
                              std::exp(-off * off - 0.5f * apart.squaredNorm() / (within_m * within_m + 1e-12f));
              mean += w * shadows_[at(x, y)].value;
              weights += w;
            }
          }
          add(at(u, v), weights > 0 ? (mean / weights).eval() : shadows_[at(u, v)].value, narrowest_m / pixel_m);
        }
      }
    });
  }

 private:
  std::size_t at(int u, int v) const {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(u);
  }

  const DeltaLight& light_;
  const ReferenceLamp& lamp_;
  std::size_t number_;
  const std::vector<PixelSurface>& seen_;
  int width_, height_;
  float focal_px_;
  std::vector<Shadow> shadows_;
};

}  // namespace

std::vector<Rgb> hidden_by_objects(const DeltaLight& light, const std::vector<PixelSurface>& seen,
                                   const CameraModel& camera, int samples) {
  constexpr float like_normals = 32;
  std::vector<Rgb> sum(seen.size(), Rgb::Zero());
  for (std::size_t lamp = 0; lamp < light.room().lamps().size(); ++lamp) {
    LampShadow shadow(light, lamp, seen, camera);
    shadow.sample(
        samples, false, [&](const PixelSurface& p) { return !p.glossy && light.may_hide(lamp, p.surface.position_m); },
        [](Rgb& hidden, Rgb&, const DeltaLight::LampPoint& point) {
          if (point.to_object_m < kFar && !point.behind_room) hidden += point.light;
        });
    shadow.smoothed(like_normals, [&](std::size_t pixel, const Rgb& hidden, float) {
      if (!seen[pixel].glossy) sum[pixel] += hidden;
    });
  }
  return sum;
}

std::vector<std::vector<LampShare>> open_to_lamps(const DeltaLight& light, const std::vector<PixelSurface>& seen,
                                                  const CameraModel& camera, int samples) {
  constexpr float like_normals = 2;  // how much of a lamp is hidden does not follow the normal
  std::vector<std::vector<LampShare>> open;
  for (std::size_t lamp = 0; lamp < light.room().lamps().size(); ++lamp) {
    LampShadow shadow(light, lamp, seen, camera);
    shadow.sample(
        samples, true, [](const PixelSurface&) { return true; },
        [](Rgb& lit, Rgb& all, const DeltaLight::LampPoint& point) {
          all += point.light;
          if (point.to_object_m == kFar && !point.behind_room) lit += point.light;
        });
    std::vector<LampShare>& by_pixel = open.emplace_back(seen.size());
    shadow.smoothed(like_normals, [&](std::size_t pixel, const Rgb& share, float narrowest_px) {
      by_pixel[pixel] = {share[0], narrowest_px > kWide_px};
    });
  }
  return open;
}

}  // namespace lumigraft::rays
