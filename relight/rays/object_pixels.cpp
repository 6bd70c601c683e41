#include "relight/rays/object_pixels.h"

#include <bit>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "relight/rays/threads.h"

namespace lumigraft::rays {
namespace {

using Eigen::Vector3f;
using reference::MeshHit;
using reference::RayFan;
using reference::Sampler;
using reference::Surface;
using reference::Vertex;

constexpr int kInside = 4, kAtEdges = RayFan::kMost;  // rays of a pixel: in the middle of an object, and at its edge
constexpr int kMirrorRays = 4;                        // per ray that is not at an edge
constexpr int kMirrors = 2;
constexpr std::uint32_t kCameraSeed = 21, kLightSeed = 22;
constexpr float kOffPlane_px = 1.0f, kLikeNormals = 0.7f;  // cosine; of what shares the shadows of a pixel
constexpr float kSurelyFarther = 1.02f;                    // than the object
constexpr int kRow = 4;                                    // rows of pixels, a thread's turn

/// What some rays of a pixel find of the objects.
struct Found {
  int u = 0;
  std::uint32_t some = 0;  ///< by bit, the rays that do
  std::array<Vector3f, kAtEdges> w;
  std::array<MeshHit, kAtEdges> hits;
};

class ObjectView {
 public:
  ObjectView(const DeltaLight& light, const std::vector<LampPoints>& lamps, const std::vector<PixelSurface>& room,
             const Eye& eye)
      : light_(light),
        lamps_(lamps),
        room_(room),
        eye_(eye),
        eye_m_(eye.camera.T_tag_camera.translation()),
        width_(eye.camera.model.width),
        height_(eye.camera.model.height),
        first_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_)),
        rows_(static_cast<std::size_t>(height_)) {
    for (std::uint32_t k = 0; k < within_.size(); ++k) within_[k] = Sampler(kCameraSeed, 0, k).two();  // even sixteens
  }

  ObjectPixels see(int step) {
    for_each_block(height_, kRow, [&](int from, int to) {
      for (int v = from; v < to; ++v) look_at_row(v);
    });
    open_ = open_to_lamps(light_, lamps_, first_, eye_.camera.model, step);
    ObjectPixels out{Image<float>(width_, height_, 3), Image<float>(width_, height_, 1), {}};
    for_each_block(height_, 1, [&](int from, int to) {
      for (int v = from; v < to; ++v) {
        for (Found& found : rows_[static_cast<std::size_t>(v)]) shade(v, found, out);
      }
    });
    out.surfaces = std::move(first_);
    return out;
  }

 private:
  std::size_t index(int u, int v) const {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(u);
  }

  /// Of the pixel's rays, the first in within_; the first four are even too.
  static std::size_t pattern(int u, int v) { return static_cast<std::size_t>(kAtEdges * (4 * (v & 3) + (u & 3))); }

  /// Whether any ray of the pixel may meet an object.
  bool may_see(int u, int v) const {
    const Vector3f& w = room_[index(u, v)].w;
    if (w.isZero(0)) return true;  // its corners may have rays all the same
    for (const Eigen::Vector4f& sphere : light_.objects().meshes().spheres()) {
      const Vector3f to = sphere.head<3>() - eye_m_;
      const float along = std::max(to.dot(w), 0.0f);
      const float pixel_m = to.norm() / static_cast<float>(std::min(eye_.camera.model.fx, eye_.camera.model.fy));
      if ((to - along * w).squaredNorm() <= (sphere.w() + pixel_m) * (sphere.w() + pixel_m)) return true;
    }
    return false;
  }

  /// Whether the room may be nearer than `t_m` there: what is narrower than a pixel apart.
  bool may_hide(int u, int v, float t_m) const {
    for (int y = std::max(v - 1, 0); y <= std::min(v + 1, height_ - 1); ++y) {
      for (int x = std::max(u - 1, 0); x <= std::min(u + 1, width_ - 1); ++x) {
        const PixelSurface& room = room_[index(x, y)];
        if (room.known && room.depth_m < kSurelyFarther * t_m) return true;
      }
    }
    return false;
  }

  /// Sends `rays` of each of these pixels' rays, from `first` on, all in one fan.
  void look(int v, std::span<Found> pixels, int first, int rays) const {
    RayFan fan;
    fan.from_m = eye_m_;
    std::size_t slot = 0;
    for (Found& found : pixels) {
      for (int k = first; k < first + rays; ++k, ++slot) {
        const auto i = static_cast<std::size_t>(k);
        found.w[i] = fan.w[slot] = eye_.ray(found.u, v, within_[pattern(found.u, v) + i]);
        fan.limit_m[slot] = std::numeric_limits<float>::infinity();
        if (!fan.w[slot].isZero(0)) fan.some |= 1u << slot;
      }
    }
    std::array<MeshHit, RayFan::kMost> hits;
    const std::uint32_t met = light_.objects().meshes().hits(fan, hits);
    fan.some = 0;
    for (slot = 0; slot < pixels.size() * static_cast<std::size_t>(rays); ++slot) {
      if (!(met >> slot & 1)) continue;
      fan.limit_m[slot] = hits[slot].t_m;
      if (may_hide(pixels[slot / static_cast<std::size_t>(rays)].u, v, hits[slot].t_m)) fan.some |= 1u << slot;
    }
    const std::uint32_t open = met & ~light_.room().meshes().blocked(fan);
    for (slot = 0; slot < pixels.size() * static_cast<std::size_t>(rays); ++slot) {
      if (!(open >> slot & 1)) continue;
      Found& found = pixels[slot / static_cast<std::size_t>(rays)];
      const std::size_t k = static_cast<std::size_t>(first) + slot % static_cast<std::size_t>(rays);
      found.some |= 1u << k;
      found.hits[k] = hits[slot];
    }
  }

  void look_at_row(int v) {
    std::array<Found, RayFan::kMost / kInside> together;
    std::size_t count = 0;
    const auto look_at = [&] {
      look(v, std::span(together).first(count), 0, kInside);
      for (std::size_t i = 0; i < count; ++i) {
        if (together[i].some) keep(v, together[i]);
      }
      count = 0;
    };
    for (int u = 0; u < width_; ++u) {
      if (!may_see(u, v)) continue;
      together[count] = {};
      together[count++].u = u;
      if (count == together.size()) look_at();
    }
    if (count > 0) look_at();
  }

  void keep(int v, const Found& found) {
    const auto k = static_cast<std::size_t>(std::countr_zero(found.some));
    PixelSurface& pixel = first_[index(found.u, v)];
    pixel.known = true;
    pixel.surface = light_.objects().meshes().surface(found.hits[k], found.w[k]);
    pixel.w = found.w[k];
    pixel.depth_m = found.hits[k].t_m;
    pixel.albedo = pixel.surface.look.diffuse;
    rows_[static_cast<std::size_t>(v)].push_back(found);
  }

  void shade(int v, Found& found, ObjectPixels& out) const {
    std::array<Surface, kAtEdges> surfaces;
    bool edge = std::popcount(found.some) < kInside;
    const PixelSurface& first = first_[index(found.u, v)];
    const auto take = [&](int from, int to) {
      for (int k = from; k < to; ++k) {
        const auto i = static_cast<std::size_t>(k);
        if (!(found.some >> k & 1)) continue;
        surfaces[i] = light_.objects().meshes().surface(found.hits[i], found.w[i]);
        edge |= !goes_on(first, surfaces[i]);
      }
    };
    take(0, kInside);
    int rays = kInside;
    if (edge) {
      look(v, std::span(&found, 1), kInside, kAtEdges - kInside);
      take(kInside, kAtEdges);
      rays = kAtEdges;
    }
    Rgb sum = Rgb::Zero();
    for (int k = 0; k < rays; ++k) {
      if (!(found.some >> k & 1)) continue;
      const auto i = static_cast<std::size_t>(k);
      Sampler sampler(kLightSeed, static_cast<std::uint32_t>(index(found.u, v)), static_cast<std::uint32_t>(k));
      sum += radiance(found.w[i], found.hits[i], surfaces[i],
                      lit(surfaces[i], found.u, v, k, goes_on(first, surfaces[i])), sampler, edge ? 1 : kMirrorRays);
    }
    for (std::size_t c = 0; c < 3; ++c) {
      out.radiance.data[3 * index(found.u, v) + c] = sum[static_cast<Eigen::Index>(c)] / static_cast<float>(rays);
    }
    out.coverage.data[index(found.u, v)] = static_cast<float>(std::popcount(found.some)) / static_cast<float>(rays);
  }

  bool goes_on(const PixelSurface& first, const Surface& surface) const {
    const float pixel_m = first.depth_m / static_cast<float>(eye_.camera.model.fx);
    return std::abs(first.surface.normal.dot(surface.position_m - first.surface.position_m)) < kOffPlane_px * pixel_m &&
           first.surface.normal.dot(surface.normal) > kLikeNormals;
  }

  /// Irradiance of lamps over π.
  Rgb lit(const Surface& surface, int u, int v, int ray, bool shares) const {
    Rgb sum = Rgb::Zero();
    for (std::size_t lamp = 0; lamp < lamps_.size(); ++lamp) {
      const Rgb radiance = lamps_[lamp].lamp().radiance / reference::kPi;
      const LampShare& share = open_[lamp][index(u, v)];
      if (shares && share.holds_near) {
        if (share.open > 0) sum += radiance * (share.open * lamps_[lamp].unhidden(surface));
        continue;
      }
      // Where shadows are sharp, every ray's own: a few points, others for each.
      LampFan fan = lamps_[lamp].from(surface, (4 * (v & 3) + (u & 3) + ray) % LampPoints::kSets);
      fan.rays.some &= 0xfu << (4 * (ray & 3));
      std::uint32_t open = fan.rays.some & ~light_.objects().meshes().blocked(fan.rays);
      fan.rays.some = open;
      open &= ~light_.behind_room(fan.rays, lamp);
      for (std::size_t k = 0; k < RayFan::kMost; ++k) {
        if (open >> k & 1) sum += 4 * radiance * fan.weight[k];
      }
    }
    return sum;
  }

  Rgb radiance(const Vector3f& w, const MeshHit& hit, const Surface& surface, const Rgb& lamps, Sampler& sampler,
               int mirror_rays) const {
    const Rgb arriving = light_.objects().irradiance(hit, surface.face).indirect / reference::kPi;
    const Rgb sum = diffuse_under(surface.look, -surface.normal.dot(w)) * (arriving + lamps);
    if (!surface.look.mirrors()) return sum;
    Surface mirror = surface;
    mirror.look = mirror_of(surface.look);
    const Vertex lobe(mirror, w);
    Rgb mirrored = Rgb::Zero();
    for (int k = 0; k < mirror_rays; ++k) mirrored += light_.mirrored_by_object(lobe, sampler, kMirrors);
    return sum + mirrored / static_cast<float>(mirror_rays);
  }

  const DeltaLight& light_;
  const std::vector<LampPoints>& lamps_;
  const std::vector<PixelSurface>& room_;
  const Eye& eye_;
  Vector3f eye_m_;
  int width_, height_;
  std::array<Eigen::Vector2f, 16 * kAtEdges> within_;  ///< where rays go in each of 4 × 4 pixels
  std::vector<PixelSurface> first_;  ///< by pixel, what the first of its rays finds that finds anything
  std::vector<std::vector<Found>> rows_;
  std::vector<std::vector<LampShare>> open_;  ///< by lamp and pixel
};

}  // namespace

ObjectPixels see_objects(const DeltaLight& light, const std::vector<LampPoints>& lamps,
                         const std::vector<PixelSurface>& room, const Eye& eye, int step) {
  return ObjectView(light, lamps, room, eye).see(step);
}

}  // namespace lumigraft::rays
