#include "relight/gather/pixel_repair.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "capture/camera/srgb.h"
#include "relight/gather/parameters.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

constexpr std::array<std::array<int, 2>, 8> kWays = {
    {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, 1}, {1, -1}, {-1, -1}}};

/// Replaces pixels in tiles by what `better(u, v)` returns, if anything, after it was called for all of them.
template <typename Better>
void replace_pixels(const TileMask& tiles, std::vector<GBufferPixel>& seen, int width, int height, Better better) {
  std::vector<std::vector<std::pair<std::size_t, GBufferPixel>>> rows(static_cast<std::size_t>(height));
  for_each_pixel(tiles, width, height, kRows, [&](int u, int v) {
    if (const std::optional<GBufferPixel> pixel = better(u, v)) {
      rows[static_cast<std::size_t>(v)].emplace_back(v * width + u, *pixel);
    }
  });
  for (const auto& row : rows) {
    for (const auto& [i, pixel] : row) seen[i] = pixel;
  }
}

bool is_hole(const GBufferPixel& p) { return !p.known || (!p.glossy && p.albedo.maxCoeff() <= 0); }

Rgb coded(const Rgb& light, const Rgb& exposure) {
  return {capture::linear_to_srgb(exposure[0] * light[0]), capture::linear_to_srgb(exposure[1] * light[1]),
          capture::linear_to_srgb(exposure[2] * light[2])};
}

struct Side {
  int pixel = -1, steps = 0;
};

class Edges {
 public:
  Edges(const PosedCamera& camera, const capture::Image<float>& radiance, const Rgb& exposure, float voxel_m,
        const std::vector<GBufferPixel>& seen)
      : eye_m_(camera.T_tag_camera.translation()),
        focal_px_(static_cast<float>(camera.model.fx)),
        width_(camera.model.width),
        height_(camera.model.height),
        radiance_(radiance),
        exposure_(exposure),
        voxel_m_(voxel_m),
        seen_(seen) {}

  bool turns_at(int u, int v) const {
    const GBufferPixel& p = at(u, v);
    if (!is_even(p)) return false;
    const int r = round_px(p);
    return std::any_of(kWays.begin(), kWays.begin() + 4, [&](const auto& way) {
      const GBufferPixel* q = neighbour_of(p, u + r * way[0], v + r * way[1]);
      return q && q->surface.normal.dot(p.surface.normal) < kGather.edge_turn;
    });
  }

  std::optional<GBufferPixel> sharp(int u, int v, const std::vector<std::uint8_t>& turns) const {
    const GBufferPixel& p = at(u, v);
    const auto [a, b] = sides(u, v, turns);
    if (b.pixel < 0) return std::nullopt;
    const GBufferPixel &of_a = seen_[static_cast<std::size_t>(a.pixel)],
                       &of_b = seen_[static_cast<std::size_t>(b.pixel)];
    const Vector3f apart = of_b.surface.position_m - of_a.surface.position_m;
    const float from_a = of_a.surface.normal.dot(apart), from_b = -of_b.surface.normal.dot(apart);
    if (!(from_a * from_b > 0)) return std::nullopt;
    const bool convex = from_a < 0;
    const auto t_a = intersection(p.w, of_a), t_b = intersection(p.w, of_b);
    if (!t_a && !t_b) return std::nullopt;
    bool takes_a = t_a.has_value();
    if (t_a && t_b) {
      // At a convex edge a ray enters through the last of the planes; at a concave one through the first.
      const float t = convex ? std::max(*t_a, *t_b) : std::min(*t_a, *t_b);
      const int own = v * width_ + u;
      const auto cost = [&](float t_side, int pixel) {
        return std::abs(t_side - t) / (kGather.edge_unlike * voxel_m_) + unlike(own, pixel) / kGather.edge_unlike_color;
      };
      takes_a = cost(*t_a, a.pixel) <= cost(*t_b, b.pixel);
    }
    return on(p, takes_a ? of_a : of_b, v * width_ + u, takes_a ? a.pixel : b.pixel, takes_a ? *t_a : *t_b);
  }

 private:
  static bool is_even(const GBufferPixel& p) { return p.known && !p.glossy && p.albedo.maxCoeff() > 0; }
  const GBufferPixel& at(int u, int v) const { return seen_[static_cast<std::size_t>(v * width_ + u)]; }
  float reach_px(const GBufferPixel& p, float voxels) const { return voxels * voxel_m_ * focal_px_ / p.depth_m; }

  int round_px(const GBufferPixel& p) const {
    return std::max(static_cast<int>(std::lround(reach_px(p, kGather.edge_round))), 1);
  }

  const GBufferPixel* neighbour_of(const GBufferPixel& p, int u, int v) const {
    if (u < 0 || v < 0 || u >= width_ || v >= height_) return nullptr;
    const GBufferPixel& q = at(u, v);
    return is_even(q) && std::abs(q.depth_m - p.depth_m) < kGather.edge_reach * voxel_m_ ? &q : nullptr;
  }

  /// Over the distance within which an edge is rounded.
  bool is_flat(int u, int v, const std::array<int, 2>& way) const {
    const GBufferPixel& p = at(u, v);
    const int r = round_px(p);
    const GBufferPixel* on = neighbour_of(p, u + r * way[0], v + r * way[1]);
    return on && on->surface.normal.dot(p.surface.normal) > kGather.edge_flat;
  }

  /// The nearest plane next to a pixel, and the nearest different one; pixel -1: none.
  std::array<Side, 2> sides(int u, int v, const std::vector<std::uint8_t>& turns) const {
    const GBufferPixel& p = at(u, v);
    const int reach = static_cast<int>(std::ceil(reach_px(p, kGather.edge_reach)));
    std::array<Side, kWays.size()> found;
    for (std::size_t i = 0; i < kWays.size(); ++i) {
      const auto& [x, y] = kWays[i];
      for (int s = 1; s <= reach; ++s) {
        if (!neighbour_of(p, u + s * x, v + s * y)) break;
        const int pixel = (v + s * y) * width_ + u + s * x;
        if (turns[static_cast<std::size_t>(pixel)]) continue;
        if (is_flat(u + s * x, v + s * y, kWays[i])) found[i] = {pixel, s};
        break;
      }
    }
    std::array<Side, 2> two;
    const auto normal = [&](const Side& s) -> const Vector3f& {
      return seen_[static_cast<std::size_t>(s.pixel)].surface.normal;
    };
    for (const Side& s : found) {
      if (s.pixel >= 0 && (two[0].pixel < 0 || s.steps < two[0].steps)) two[0] = s;
    }
    for (const Side& s : found) {
      if (s.pixel < 0 || !(normal(s).dot(normal(two[0])) < kGather.edge_turn)) continue;
      if (two[1].pixel < 0 || s.steps < two[1].steps) two[1] = s;
    }
    return two;
  }

  std::optional<float> intersection(const Vector3f& w, const GBufferPixel& side) const {
    const float fall = side.surface.normal.dot(w);
    if (fall > -kGather.grazing) return std::nullopt;
    return side.surface.normal.dot(side.surface.position_m - eye_m_) / fall;
  }

  Rgb pixel(int i) const { return radiance_at(radiance_, static_cast<std::size_t>(i)); }

  float unlike(int a, int b) const {
    const Rgb off = coded(pixel(a), exposure_) - coded(pixel(b), exposure_);
    return std::sqrt(off[0] * off[0] + off[1] * off[1] + off[2] * off[2]);
  }

  /// The pixel moved to a side's plane, at distance `t` along its ray.
  std::optional<GBufferPixel> on(const GBufferPixel& p, const GBufferPixel& side, int own, int of_side, float t) const {
    if (!(std::abs(t - p.depth_m) < kGather.edge_off * voxel_m_)) return std::nullopt;
    GBufferPixel sharp = p;
    sharp.surface.normal = sharp.surface.face = side.surface.normal;
    // Neither below the fused surface nor below the plane, either of which would occlude everything from there.
    const float below = std::max(side.surface.normal.dot(eye_m_ + t * p.w - p.surface.position_m), 0.0f);
    sharp.surface.position_m += (below + kGather.edge_lift * voxel_m_) * side.surface.normal;
    sharp.albedo = detailed(side.albedo, pixel(own), pixel(of_side));
    return sharp;
  }

  Vector3f eye_m_;
  float focal_px_;
  int width_, height_;
  const capture::Image<float>& radiance_;
  Rgb exposure_;
  float voxel_m_;
  const std::vector<GBufferPixel>& seen_;
};

}  // namespace

void fill_holes(const PosedCamera& camera, const capture::Image<float>& radiance, const Rgb& exposure,
                const TileMask& tiles, std::vector<GBufferPixel>& seen) {
  const int width = camera.model.width, height = camera.model.height;
  const float reach = kGather.hole_reach * static_cast<float>(width);
  const auto usable = [&](int u, int v) {
    if (u < 0 || v < 0 || u >= width || v >= height) return false;
    const GBufferPixel& p = seen[static_cast<std::size_t>(v * width + u)];
    return !is_hole(p) && !p.glossy;
  };
  const auto unlike = [](const Rgb& a, const Rgb& b) { return std::sqrt((a - b).square().sum()); };
  replace_pixels(tiles, seen, width, height, [&](int u, int v) -> std::optional<GBufferPixel> {
    const GBufferPixel& hole = seen[static_cast<std::size_t>(v * width + u)];
    if (!(is_hole(hole) || hole.modelled) || hole.w.isZero(0)) return std::nullopt;
    const bool behind = !is_hole(hole);
    const auto counts = [&](int x, int y) {
      return usable(x, y) && !(behind && seen[static_cast<std::size_t>(y * width + x)].modelled);
    };
    const Rgb own = radiance_at(radiance, static_cast<std::size_t>(v * width + u)), own_code = coded(own, exposure);
    float min_unlike = kGather.hole_color;
    if (behind) min_unlike = std::min(min_unlike, unlike(coded(hole.before, exposure), own_code));
    int best = -1;
    for (const auto& [x, y] : kWays) {
      for (int s = 1; s <= static_cast<int>(reach); ++s) {
        if (!counts(u + s * x, v + s * y)) continue;
        // Fused surfaces are rounded at their ends; slightly farther inside they are flat.
        const int in = counts(u + (s + 2) * x, v + (s + 2) * y) ? s + 2 : s;
        const int at = (v + in * y) * width + u + in * x;
        const Rgb code = coded(radiance_at(radiance, static_cast<std::size_t>(at)), exposure);
        const float found = unlike(code, own_code) + kGather.hole_near_color * static_cast<float>(s) / reach;
        if (found < min_unlike) {
          min_unlike = found;
          best = at;
        }
        break;
      }
    }
    if (best < 0) return std::nullopt;
    const GBufferPixel& similar = seen[static_cast<std::size_t>(best)];
    const Vector3f eye_m = camera.T_tag_camera.translation(), &n = similar.surface.normal;
    const float fall = n.dot(hole.w), t = n.dot(similar.surface.position_m - eye_m) / fall;
    if (behind && !(t < hole.depth_m)) return std::nullopt;
    if (fall > -kGather.grazing || !(std::abs(t - similar.depth_m) < 0.5f * similar.depth_m)) return std::nullopt;
    GBufferPixel p = similar;
    p.before.setZero();
    p.modelled = false;
    p.w = hole.w;
    p.depth_m = t;
    p.surface.position_m = eye_m + t * hole.w;
    p.surface.face = n;
    p.albedo = detailed(similar.albedo, own, radiance_at(radiance, static_cast<std::size_t>(best)));
    return p;
  });
}

void sharpen_edges(const PosedCamera& camera, const capture::Image<float>& radiance, const Rgb& exposure, float voxel_m,
                   const TileMask& tiles, std::vector<GBufferPixel>& seen) {
  const Edges edges(camera, radiance, exposure, voxel_m, seen);
  const int width = camera.model.width, height = camera.model.height;
  std::vector<std::uint8_t> turns(seen.size());
  for_each_pixel(tiles, width, height, kRows,
                 [&](int u, int v) { turns[static_cast<std::size_t>(v * width + u)] = edges.turns_at(u, v); });
  replace_pixels(tiles, seen, width, height, [&](int u, int v) {
    return turns[static_cast<std::size_t>(v * width + u)] ? edges.sharp(u, v, turns) : std::nullopt;
  });
}

}  // namespace lumigraft::relight
