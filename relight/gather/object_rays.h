#pragma once
// The rays of a camera that meet objects: which objects a picture shows where, with several rays per pixel at their
// edges.
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "relight/compose/current_depth.h"
#include "relight/gather/gbuffer.h"
#include "relight/gather/object_window.h"
#include "relight/gather/parameters.h"
#include "relight/gather_quality.h"
#include "relight/tracing/meshes.h"
#include "relight/tracing/parallel_for.h"
#include "relight/tracing/sampler.h"

namespace lumigraft::relight {

constexpr int kMaxInside = 4;  // rays per pixel in the interior of an object

/// Object hits of a pixel's interior rays.
struct PixelHits {
  int u = 0;
  std::uint32_t some = 0;  ///< bit mask of the rays that hit
  std::array<Eigen::Vector3f, kMaxInside> w;
  std::array<MeshHit, kMaxInside> hits;

  std::size_t first() const { return static_cast<std::size_t>(std::countr_zero(some)); }
};

/// In the smallest window that contains all pixels showing objects; u, v: pixels of the window. Arrays are per pixel of
/// it, unless noted. `RoomDepth`: distance to the room along the ray of a pixel of the image (u, v), infinite where no
/// surface is known.
template <typename RoomDepth>
class ObjectRays {
 public:
  static constexpr int kMaxRays = RayFan::kMaxRays;  ///< per pixel

  /// Keeps references. Where `depth` is clearly before or behind an object, the room does not hide it.
  ObjectRays(const Meshes& objects, const Meshes& room, RoomDepth room_depth, const CameraRays& eye,
             const CurrentDepth& depth, const GatherQuality& detail)
      : objects_(objects),
        room_(room),
        room_depth_(std::move(room_depth)),
        eye_(eye),
        depth_(depth),
        inside_(detail.inside),
        eye_m_(eye.camera.T_tag_camera.translation()),
        window_(window_of(objects.spheres(), eye)),
        rows_(static_cast<std::size_t>(window_.height)) {
    constexpr std::uint32_t kCameraSeed = 21;
    for (std::uint32_t k = 0; k < within_.size(); ++k)
      within_[k] = Sampler(kCameraSeed, 0, k).two();  // stratified in sixteenths
  }

  /// Traces the interior rays of all pixels, and adds those at outlines.
  void find() {
    first_m_.assign(static_cast<std::size_t>(window_.width) * static_cast<std::size_t>(window_.height), 0);
    for_each_index(window_.height, kRows, [&](int v) { trace_row(v); });
    if (inside_ == 1) add_outlines();
  }

  const PixelWindow& window() const { return window_; }
  const Eigen::Vector3f& eye_m() const { return eye_m_; }
  const std::vector<PixelHits>& row(int v) const { return rows_[static_cast<std::size_t>(v)]; }
  std::size_t index(int u, int v) const {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(window_.width) + static_cast<std::size_t>(u);
  }
  /// Direction of a pixel's ray at this position within it.
  Eigen::Vector3f ray_at(int u, int v, const Eigen::Vector2f& within = {0.5f, 0.5f}) const {
    return eye_.ray(u + window_.left, v + window_.top, within);
  }
  /// Where a pixel's ray passes through it.
  const Eigen::Vector2f& within(int u, int v, int ray) const {
    return within_[static_cast<std::size_t>(kMaxRays * (4 * (v & 3) + (u & 3)) + ray)];
  }

  /// Whether a surface edge separates the pixel from a neighbour.
  bool is_edge(int u, int v) const {
    const float own_m = first_m_[index(u, v)];
    const auto ends = [&](int x, int y) {
      if (x < 0 || y < 0 || x >= window_.width || y >= window_.height) return false;
      const float other_m = first_m_[index(x, y)];
      const float apart_px = std::abs(own_m - other_m) * static_cast<float>(eye_.camera.model.fx);
      return (own_m > 0) != (other_m > 0) || (own_m > 0 && apart_px > kGather.jump_px * own_m);
    };
    return ends(u - 1, v) || ends(u + 1, v) || ends(u, v - 1) || ends(u, v + 1);
  }

  /// Whether the fused room may be nearer than `t_m` there, except for parts narrower than a pixel, and depth leaves it
  /// open.
  bool may_hide(int u, int v, float t_m) const {
    u += window_.left;
    v += window_.top;
    if (depth_.differs(u, v, t_m)) return false;
    const int left = std::max(u - 1, 0), right = std::min(u + 1, eye_.camera.model.width - 1), top = std::max(v - 1, 0),
              bottom = std::min(v + 1, eye_.camera.model.height - 1);
    for (int y = top; y <= bottom; ++y) {
      for (int x = left; x <= right; ++x) {
        if (room_depth_(x, y) < kGather.surely_farther * t_m) return true;
      }
    }
    return false;
  }

  /// Traces the rays `first` to `first + rays` of each of these pixels in one packet. `found(pixel, ray, w, hit)`.
  template <typename Found>
  void trace(int v, std::span<const int> pixels, int first, int rays, Found found) const {
    const int slots = static_cast<int>(pixels.size()) * rays;
    RayFan fan;
    fan.from_m = eye_m_;
    for (int slot = 0; slot < slots; ++slot) {
      const int u = pixels[static_cast<std::size_t>(slot / rays)];
      const auto i = static_cast<std::size_t>(slot);
      const int ray = first + slot % rays;
      fan.w[i] = is_central(ray) ? ray_at(u, v) : ray_at(u, v, within(u, v, ray));
      fan.limit_m[i] = std::numeric_limits<float>::infinity();
      if (!fan.w[i].isZero(0)) fan.some |= 1u << slot;
    }
    std::array<MeshHit, RayFan::kMaxRays> hits;
    const std::uint32_t met = objects_.hits(fan, hits, Coverage::full);
    fan.some = 0;
    for (int slot = 0; slot < slots; ++slot) {
      if (!(met >> slot & 1)) continue;
      const float t_m = fan.limit_m[static_cast<std::size_t>(slot)] = hits[static_cast<std::size_t>(slot)].t_m;
      if (may_hide(pixels[static_cast<std::size_t>(slot / rays)], v, t_m)) fan.some |= 1u << slot;
    }
    const std::uint32_t open = met & ~room_.blocked(fan);
    for (int slot = 0; slot < slots; ++slot) {
      const auto i = static_cast<std::size_t>(slot);
      if (open >> slot & 1) found(static_cast<std::size_t>(slot / rays), first + slot % rays, fan.w[i], hits[i]);
    }
  }

 private:
  /// Whether a pixel's ray passes through its centre, like those of the room's G-buffer.
  bool is_central(int ray) const { return inside_ == 1 && ray == 0; }

  /// Whether any ray of the pixel may meet an object.
  bool may_see(int u, int v) const {
    const Eigen::Vector3f w = ray_at(u, v);
    if (w.isZero(0)) return true;  // its corners may still have rays
    for (const Eigen::Vector4f& sphere : objects_.spheres()) {
      const Eigen::Vector3f to = sphere.head<3>() - eye_m_;
      const float along = std::max(to.dot(w), 0.0f);
      const float pixel_m = to.norm() / static_cast<float>(std::min(eye_.camera.model.fx, eye_.camera.model.fy));
      if ((to - along * w).squaredNorm() <= (sphere.w() + pixel_m) * (sphere.w() + pixel_m)) return true;
    }
    return false;
  }

  void trace_row(int v) {
    std::array<int, kMaxRays> pixels;
    std::array<PixelHits, kMaxRays> together;
    std::size_t count = 0;
    const auto trace_batch = [&] {
      trace(v, std::span(pixels).first(count), 0, inside_,
            [&](std::size_t pixel, int ray, const Eigen::Vector3f& w, const MeshHit& hit) {
              together[pixel].some |= 1u << ray;
              together[pixel].w[static_cast<std::size_t>(ray)] = w;
              together[pixel].hits[static_cast<std::size_t>(ray)] = hit;
            });
      for (std::size_t i = 0; i < count; ++i) {
        const PixelHits& found = together[i];
        if (!found.some) continue;
        first_m_[index(found.u, v)] = found.hits[found.first()].t_m;
        rows_[static_cast<std::size_t>(v)].push_back(found);
      }
      count = 0;
    };
    for (int u = 0; u < window_.width; ++u) {
      if (!may_see(u, v)) continue;
      pixels[count] = together[count].u = u;
      together[count++].some = 0;
      if (count == static_cast<std::size_t>(kMaxRays / inside_)) trace_batch();
    }
    if (count > 0) trace_batch();
  }

  /// Pixels of one ray without a hit, next to pixels with hits.
  void add_outlines() {
    for_each_pixel(window_.width, window_.height, kRows, [&](int u, int v) {
      if (first_m_[index(u, v)] > 0 || !is_edge(u, v)) return;
      rows_[static_cast<std::size_t>(v)].emplace_back().u = u;
    });
  }

  const Meshes& objects_;
  const Meshes& room_;
  RoomDepth room_depth_;
  CameraRays eye_;
  const CurrentDepth& depth_;
  int inside_;  ///< rays per pixel
  Eigen::Vector3f eye_m_;
  PixelWindow window_;
  std::array<Eigen::Vector2f, 16 * kMaxRays> within_;  ///< positions of the rays in each of 4 × 4 pixels
  std::vector<float> first_m_;                         ///< along the ray to the first of a pixel's hits; 0: none
  std::vector<std::vector<PixelHits>> rows_;           ///< of pixels with hits, and those at outlines
};

}  // namespace lumigraft::relight
