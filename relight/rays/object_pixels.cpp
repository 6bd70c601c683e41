#include "relight/rays/object_pixels.h"

#include <cmath>
#include <limits>
#include <vector>

#include "relight/rays/threads.h"

namespace lumigraft::rays {
namespace {

using Eigen::Vector3f;
using reference::MeshHit;
using reference::Sampler;
using reference::Surface;
using reference::Vertex;

constexpr int kInside = 4, kAtEdges = 16;    // rays of a pixel: those in the middle of an object, and at its edge
constexpr int kLampPoints = 2, kTested = 4;  // of each lamp, per ray; the latter where each has its shadow tested
constexpr int kShadowPoints = 16;            // of each lamp, per pixel
constexpr int kMirrorRays = 4;               // per ray that is not at an edge
constexpr int kMirrors = 2;
constexpr std::uint32_t kCameraSeed = 21, kLightSeed = 22;
constexpr float kOffPlane_px = 1.0f, kLikeNormals = 0.7f;  // cosine; of what shares the shadows of its pixel
constexpr int kRow = 4;                                    // rows of pixels, a thread's turn

struct Seen {
  Vector3f w;
  MeshHit hit;
};

class ObjectView {
 public:
  ObjectView(const DeltaLight& light, const ReferenceCamera& camera)
      : light_(light), camera_(camera), eye_m_(camera.T_tag_camera.translation()) {}

  ObjectPixels see() {
    const int width = camera_.model.width, height = camera_.model.height;
    std::vector<PixelSurface> first(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for_each_block(height, kRow, [&](int from, int to) {
      for (int v = from; v < to; ++v) {
        for (int u = 0; u < width; ++u) look_first(u, v, first[index(u, v)]);
      }
    });
    const std::vector<std::vector<LampShare>> open = open_to_lamps(light_, first, camera_.model, kShadowPoints);
    ObjectPixels out{Image<float>(width, height, 3), Image<float>(width, height, 1), {}};
    for_each_block(height, kRow, [&](int from, int to) {
      for (int v = from; v < to; ++v) {
        for (int u = 0; u < width; ++u) {
          if (first[index(u, v)].known) shade(u, v, first[index(u, v)], open, out);
        }
      }
    });
    out.surfaces = std::move(first);
    return out;
  }

 private:
  std::size_t index(int u, int v) const {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(camera_.model.width) + static_cast<std::size_t>(u);
  }

  std::optional<Seen> look(int u, int v, int sample) const {
    Sampler sampler(kCameraSeed, static_cast<std::uint32_t>(index(u, v)), static_cast<std::uint32_t>(sample));
    const Vector3f w = camera_ray(camera_, u, v, sampler.two());
    if (w.isZero()) return std::nullopt;
    const auto hit = light_.objects().meshes().hit(eye_m_, w, std::numeric_limits<float>::infinity());
    if (!hit || light_.room().meshes().blocked(eye_m_, w, hit->t_m)) return std::nullopt;
    return Seen{w, *hit};
  }

  /// What the first of a pixel's rays finds that finds anything.
  void look_first(int u, int v, PixelSurface& pixel) const {
    for (int k = 0; k < kInside && !pixel.known; ++k) {
      const std::optional<Seen> seen = look(u, v, k);
      if (!seen) continue;
      pixel.known = true;
      pixel.surface = light_.objects().meshes().surface(seen->hit, seen->w);
      pixel.w = seen->w;
      pixel.depth_m = seen->hit.t_m;
      pixel.albedo = pixel.surface.look.diffuse;
    }
  }

  void shade(int u, int v, const PixelSurface& first, const std::vector<std::vector<LampShare>>& open,
             ObjectPixels& out) const {
    Rgb sum = Rgb::Zero();
    int covered = 0, rays = kInside;
    bool edge = false;
    for (int k = 0; k < rays; ++k) {
      if (const std::optional<Seen> seen = look(u, v, k)) {
        ++covered;
        Sampler sampler(kLightSeed, static_cast<std::uint32_t>(index(u, v)), static_cast<std::uint32_t>(k));
        const Surface surface = light_.objects().meshes().surface(seen->hit, seen->w);
        const bool shares = goes_on(first, surface);
        edge |= !shares;
        sum += radiance(*seen, surface, sampler,
                        [&](const Vertex& white) { return lit(white, index(u, v), shares, open, sampler); });
      }
      if (k + 1 == kInside && (covered < kInside || edge)) rays = kAtEdges;
    }
    for (std::size_t c = 0; c < 3; ++c) {
      out.radiance.data[3 * index(u, v) + c] = sum[static_cast<Eigen::Index>(c)] / static_cast<float>(rays);
    }
    out.coverage.data[index(u, v)] = static_cast<float>(covered) / static_cast<float>(rays);
  }

  bool goes_on(const PixelSurface& first, const Surface& surface) const {
    const float pixel_m = first.depth_m / static_cast<float>(camera_.model.fx);
    return std::abs(first.surface.normal.dot(surface.position_m - first.surface.position_m)) < kOffPlane_px * pixel_m &&
           first.surface.normal.dot(surface.normal) > kLikeNormals;
  }

  Rgb lit(const Vertex& white, std::size_t pixel, bool shares, const std::vector<std::vector<LampShare>>& open,
          Sampler& sampler) const {
    Rgb sum = Rgb::Zero();
    for (std::size_t lamp = 0; lamp < open.size(); ++lamp) {
      const LampShare& share = open[lamp][pixel];
      if (shares && share.holds_near) {
        for (int k = 0; k < kLampPoints && share.open > 0; ++k) {
          sum += light_.unhidden(white, lamp, sampler.two()) * (share.open / kLampPoints);
        }
        continue;
      }
      for (int k = 0; k < kTested; ++k) {
        const DeltaLight::LampPoint point = light_.lamp_point(white, lamp, sampler.two());
        if (!point.behind_room && std::isinf(point.to_object_m)) sum += point.light / kTested;
      }
    }
    return sum;
  }

  template <typename Lamps>
  Rgb radiance(const Seen& seen, const Surface& surface, Sampler& sampler, Lamps lamps) const {
    const Rgb diffuse = diffuse_under(surface.look, -surface.normal.dot(seen.w));
    const Rgb arriving = light_.objects().irradiance(seen.hit, surface.face).indirect / reference::kPi;
    Rgb sum = diffuse * (arriving + lamps(Vertex(white_surface(surface), seen.w)));
    if (!surface.look.mirrors()) return sum;
    Surface mirror = surface;
    mirror.look = mirror_of(surface.look);
    const Vertex lobe(mirror, seen.w);
    Rgb mirrored = Rgb::Zero();
    for (int k = 0; k < kMirrorRays; ++k) mirrored += light_.mirrored_by_object(lobe, sampler, kMirrors) / kMirrorRays;
    return sum + mirrored;
  }

  const DeltaLight& light_;
  const ReferenceCamera& camera_;
  Vector3f eye_m_;
};

}  // namespace

ObjectPixels see_objects(const DeltaLight& light, const ReferenceCamera& camera) {
  return ObjectView(light, camera).see();
}

}  // namespace lumigraft::rays
