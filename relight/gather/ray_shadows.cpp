#include "relight/gather/ray_shadows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "relight/gather/parameters.h"
#include "relight/tracing/fast_exp.h"
#include "relight/tracing/lamps.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr int kReach = kGather.penumbra_reach_px;
constexpr std::uint32_t kShadowSeed = 31;

enum class On { room, objects };
enum class By { objects, anything };  // what occludes

struct Shadow {
  float hidden = 0;         ///< fraction of the lamp's light that is occluded
  float all = 0;            ///< ShadowRayPacket::all; 0: not traced
  float penumbra_m = kFar;  ///< width of the narrowest penumbra here
  bool known = true;        ///< else interpolated from the neighbours
};

class LampShadow {
 public:
  LampShadow(On on, By by, const DeltaLight& light, std::size_t lamp, const LightSource& points,
             const std::vector<GBufferPixel>& seen, const capture::CameraModel& camera, const GatherQuality& detail)
      : on_(on),
        by_(by),
        light_(light),
        points_(points),
        lamp_(lamp),
        seen_(seen),
        width_(camera.width),
        height_(camera.height),
        focal_px_(static_cast<float>(camera.fx)),
        rays_(detail.lamp_rays),
        sparse_(detail.sparse),
        shadows_(seen.size()) {}

  void compute(int step) {
    // First pass: corners of blocks of pixels.
    const int across = (width_ + step - 2) / step + 1, down = (height_ + step - 2) / step + 1;
    std::vector<std::uint8_t> corners(static_cast<std::size_t>(across) * static_cast<std::size_t>(down));
    const auto corner = [&](int i, int j) -> std::uint8_t& {
      return corners[static_cast<std::size_t>(std::clamp(j, 0, down - 1)) * static_cast<std::size_t>(across) +
                     static_cast<std::size_t>(std::clamp(i, 0, across - 1))];
    };
    for_each_pixel(across, down, 1, [&](int i, int j) {
      corner(i, j) = trace(std::min(i * step, width_ - 1), std::min(j * step, height_ - 1));
    });
    for_each_pixel(across, down, 1, [&](int i, int j) {
      std::uint8_t around = 0;
      bool sparse = sparse_;
      for (int y = j - 1; y <= j + 2; ++y) {
        for (int x = i - 1; x <= i + 2; ++x) {
          around |= corner(x, y);
          sparse = sparse && is_wide(std::clamp(x, 0, across - 1) * step, std::clamp(y, 0, down - 1) * step);
        }
      }
      fill(i * step, j * step, step, around, sparse);
    });
  }

  /// Calls `add(pixel, shadow, width of the narrowest nearby penumbra over a pixel's width)` for every traced pixel.
  template <typename Add>
  void smoothed(Add add) const {
    const std::vector<std::uint8_t> at_edge = near_edges();
    for_each_pixel(width_, height_, kRows, [&](int u, int v) {
      const std::size_t pixel = at(u, v);
      if (!is_wanted(seen_[pixel])) return;
      if (at_edge[pixel]) {
        add_mean(u, v, add);
      } else {
        add(pixel, shadows_[pixel].hidden, kFar);
      }
    });
  }

 private:
  enum Kind : std::uint8_t { kOpen = 1, kHidden = 2, kPartly = 4 };  // 0: unknown

  std::size_t at(int u, int v) const {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(u);
  }
  bool is_wanted(const GBufferPixel& p) const { return p.known && !(on_ == On::room && p.glossy); }

  std::uint8_t trace(int u, int v) {
    const GBufferPixel& p = seen_[at(u, v)];
    if (!is_wanted(p)) return 0;
    if (by_ == By::objects && !light_.may_hide(lamp_, p.surface.position_m)) return kOpen;
    ShadowRayPacket fan = points_.from(p.surface, 4 * (v & 3) + (u & 3));
    if (rays_ < RayFan::kMaxRays) fan.keep_first(rays_);
    if (!(fan.all > 0)) return 0;
    const FanOcclusion objects = light_.objects().meshes().occlusion(fan.rays);
    RayFan others = fan.rays;
    if (by_ == By::objects) others.some = objects.some;
    for (std::size_t k = 0; by_ == By::anything && k < RayFan::kMaxRays; ++k) {
      if (objects.open[k] == 0) others.some &= ~(1u << k);
    }
    const std::uint32_t room = light_.behind_room(others, lamp_);
    float sum = 0, by_objects = 0;
    bool none = true, all = true;
    for (std::size_t k = 0; k < RayFan::kMaxRays; ++k) {
      if (!(fan.rays.some >> k & 1)) continue;
      const float alone = 1 - objects.open[k], hidden = !(room >> k & 1) ? alone : by_ == By::objects ? 0.0f : 1.0f;
      sum += hidden * fan.weight[k];
      by_objects += alone * fan.weight[k];
      none = none && hidden == 0;
      all = all && hidden == 1;
    }
    // What the frame's shadows hide is the same that rays found, or more.
    const float open = light_.open(lamp_, p.surface.position_m);
    if (open < 1) sum = by_ == By::objects ? std::min(sum, open * by_objects) : std::max(sum, (1 - open) * fan.all);
    Shadow& shadow = shadows_[at(u, v)];
    const float lamp_m = (points_.centre_m() - p.surface.position_m).norm();
    for (std::size_t k = 0; k < RayFan::kMaxRays; ++k) {
      if (!(objects.some >> k & 1)) continue;
      const float near_m = objects.nearest_m[k], beyond_m = std::max(lamp_m - near_m, 1e-3f);
      shadow.penumbra_m = std::min(shadow.penumbra_m, 2 * points_.reach_m() * near_m / beyond_m);
    }
    shadow.hidden = sum / fan.all;
    shadow.all = fan.all;
    if (open < 1) return kPartly;
    if (none) return kOpen;
    if (all) return kHidden;
    return kPartly;
  }

  bool is_wide(int u, int v) const {
    const std::size_t pixel = at(std::min(u, width_ - 1), std::min(v, height_ - 1));
    return shadows_[pixel].penumbra_m * focal_px_ > kGather.sparse_px * seen_[pixel].depth_m;
  }

  void fill(int from_u, int from_v, int step, std::uint8_t around, bool sparse) {
    for (int v = from_v; v < std::min(from_v + step, height_); ++v) {
      for (int u = from_u; u < std::min(from_u + step, width_); ++u) {
        if (u == from_u && v == from_v) continue;
        if (around == kHidden) {
          shadows_[at(u, v)].hidden = 1;
        } else if (around == kOpen) {
          continue;
        } else if (sparse && ((u | v) & 1) != 0) {
          shadows_[at(u, v)].known = false;
        } else {
          trace(u, v);
        }
      }
    }
  }

  /// Whether a pixel is partly occluded, or fully with an unoccluded neighbour.
  bool is_edge(int u, int v) const {
    if (!shadows_[at(u, v)].known) return true;
    const float own = shadows_[at(u, v)].hidden;
    return (own > 0 && own < 1) || (u + 1 < width_ && shadows_[at(u + 1, v)].hidden != own) ||
           (v + 1 < height_ && shadows_[at(u, v + 1)].hidden != own);
  }

  /// Pixels within reach of an edge.
  std::vector<std::uint8_t> near_edges() const {
    std::vector<std::uint8_t> rows(shadows_.size()), out(shadows_.size());
    for_each_pixel(width_, height_, kRows, [&](int u, int v) {
      if (!is_edge(u, v)) return;
      std::fill(&rows[at(std::max(u - kReach, 0), v)], &rows[at(std::min(u + kReach, width_ - 1), v)] + 1, 1);
    });
    for_each_index(height_, kRows, [&](int v) {
      for (int y = std::max(v - kReach, 0); y <= std::min(v + kReach, height_ - 1); ++y) {
        for (int u = 0; u < width_; ++u) out[at(u, v)] |= rows[at(u, y)];
      }
    });
    return out;
  }

  template <typename Add>
  void add_mean(int u, int v, Add add) const {
    // Of objects, sets of points differ more than a lamp's: a kernel without response to patterns of 4 × 4 pixels.
    constexpr std::array<float, 3> of_lamp = {3.0f / 8, 1.0f / 4, 1.0f / 16},
                                   of_object = {1.0f / 4, 1.0f / 4, 1.0f / 8};
    const std::array<float, 3>& kernel = lamp_ == DeltaLight::kNoLamp ? of_object : of_lamp;
    const GBufferPixel& own = seen_[at(u, v)];
    const float pixel_m = own.depth_m / focal_px_;
    float mean = 0, weights = 0, narrowest_m = kFar;
    for (int y = std::max(v - kReach, 0); y <= std::min(v + kReach, height_ - 1); ++y) {
      for (int x = std::max(u - kReach, 0); x <= std::min(u + kReach, width_ - 1); ++x) {
        const GBufferPixel& other = seen_[at(x, y)];
        const Shadow& shadow = shadows_[at(x, y)];
        if (!shadow.known || !is_wanted(other)) continue;
        narrowest_m = std::min(narrowest_m, shadow.penumbra_m);
        const float turn = own.surface.normal.dot(other.surface.normal);
        if (turn <= 0) continue;
        const Vector3f apart = other.surface.position_m - own.surface.position_m;
        const float within_m = kGather.penumbra_sigma * std::min(shadows_[at(u, v)].penumbra_m, shadow.penumbra_m);
        const float off = own.surface.normal.dot(apart) / (kGather.off_px * pixel_m);
        const float w = kernel[static_cast<std::size_t>(std::abs(x - u))] *
                        kernel[static_cast<std::size_t>(std::abs(y - v))] * turn * turn *
                        fast_exp(off * off + 0.5f * apart.squaredNorm() / (within_m * within_m + 1e-12f));
        // Of objects a ratio of sums: next to them, sets of points differ in their light by more than in occlusion.
        const float all = lamp_ != DeltaLight::kNoLamp ? 1 : shadow.all > 0 ? shadow.all : shadows_[at(u, v)].all;
        mean += w * all * shadow.hidden;
        weights += w * all;
      }
    }
    add(at(u, v), weights > 0 ? mean / weights : shadows_[at(u, v)].hidden, narrowest_m / pixel_m);
  }

  On on_;
  By by_;
  const DeltaLight& light_;
  const LightSource& points_;
  std::size_t lamp_;  ///< DeltaLight::kNoLamp: an object
  const std::vector<GBufferPixel>& seen_;
  int width_, height_;
  float focal_px_;
  int rays_;  ///< per pixel
  bool sparse_;
  std::vector<Shadow> shadows_;
};

}  // namespace

std::vector<LightSampleSet> light_samples_of(const RayRoom& room) {
  std::vector<LightSampleSet> points;
  for (const ReferenceLamp& lamp : room.lamps()) {
    points.emplace_back(lamp, kShadowSeed + static_cast<std::uint32_t>(points.size()));
  }
  return points;
}

std::vector<Eigen::Array4f> hidden_by_objects(const DeltaLight& light, const std::vector<LightSampleSet>& lamps,
                                              const std::vector<GBufferPixel>& seen, const capture::CameraModel& camera,
                                              const GatherQuality& detail) {
  std::vector<Eigen::Array4f> sum(seen.size(), Eigen::Array4f::Zero());
  for (std::size_t lamp = 0; lamp < lamps.size(); ++lamp) {
    LampShadow shadow(On::room, By::objects, light, lamp, lamps[lamp], seen, camera, detail);
    shadow.compute(detail.step);
    shadow.smoothed([&](std::size_t pixel, float hidden, float) {
      if (hidden <= 0) return;
      sum[pixel].head<3>() += hidden * lamps[lamp].irradiance(seen[pixel].surface);
    });
  }
  return sum;
}

std::vector<Eigen::Array4f> lit_by_objects(const DeltaLight& light, const std::vector<EmitterSampleSet>& emitters,
                                           const std::vector<GBufferPixel>& seen, const capture::CameraModel& camera,
                                           const GatherQuality& detail) {
  std::vector<Eigen::Array4f> sum(seen.size(), Eigen::Array4f::Zero());
  for (const EmitterSampleSet& emitter : emitters) {
    LampShadow shadow(On::room, By::anything, light, DeltaLight::kNoLamp, emitter, seen, camera, detail);
    shadow.compute(detail.step);
    shadow.smoothed([&](std::size_t pixel, float hidden, float) {
      if (hidden < 1) sum[pixel].head<3>() += (1 - hidden) * emitter.irradiance(seen[pixel].surface);
    });
  }
  return sum;
}

std::vector<const LightSource*> light_sources(const std::vector<LightSampleSet>& lamps,
                                              const std::vector<EmitterSampleSet>& emitters) {
  std::vector<const LightSource*> sources;
  for (const LightSampleSet& lamp : lamps) sources.push_back(&lamp);
  for (const EmitterSampleSet& emitter : emitters) sources.push_back(&emitter);
  return sources;
}

std::vector<std::vector<LampVisibility>> open_to_lamps(const DeltaLight& light,
                                                       const std::vector<const LightSource*>& sources,
                                                       const std::vector<GBufferPixel>& seen,
                                                       const capture::CameraModel& camera,
                                                       const GatherQuality& detail) {
  std::vector<std::vector<LampVisibility>> open;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    const std::size_t lamp = i < light.room().lamps().size() ? i : DeltaLight::kNoLamp;
    LampShadow shadow(On::objects, By::anything, light, lamp, *sources[i], seen, camera, detail);
    shadow.compute(detail.step);
    std::vector<LampVisibility>& by_pixel = open.emplace_back(seen.size());
    shadow.smoothed([&](std::size_t pixel, float hidden, float narrowest_px) {
      by_pixel[pixel] = {1 - hidden, narrowest_px > kGather.wide_px};
    });
  }
  return open;
}

}  // namespace lumigraft::relight
