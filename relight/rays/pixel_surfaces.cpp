#include "relight/rays/pixel_surfaces.h"

#include <limits>

#include "relight/rays/threads.h"

namespace lumigraft::rays {
namespace {

using Eigen::Vector3f;

constexpr float kLeastDetail = 0.2f, kMostDetail = 4;  // of a pixel against what is around it

}  // namespace

Vector3f camera_ray(const ReferenceCamera& camera, int u, int v, const Eigen::Vector2f& within) {
  const auto w = camera.model.unproject({u + within.x() - 0.5, v + within.y() - 0.5});
  return w ? (camera.T_tag_camera.linear() * w->cast<float>()).normalized() : Vector3f::Zero().eval();
}

std::vector<PixelSurface> see_room(const RayRoom& room, const ReferenceCamera& camera, const Image<float>& radiance) {
  const int width = camera.model.width, height = camera.model.height;
  std::vector<PixelSurface> seen(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for_each_block(height, 4, [&](int first, int last) {
    for (int v = first; v < last; ++v) {
      for (int u = 0; u < width; ++u) {
        const std::size_t i =
            static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u);
        PixelSurface& p = seen[i];
        p.w = camera_ray(camera, u, v, {0.5f, 0.5f});
        if (p.w.isZero()) continue;
        const auto hit =
            room.meshes().hit(camera.T_tag_camera.translation(), p.w, std::numeric_limits<float>::infinity());
        if (!hit) continue;
        const RealPoint point = room.point(*hit, p.w);
        p.known = true;
        p.glossy = !point.is_even();
        p.surface = point.surface;
        p.depth_m = hit->t_m;
        if (p.glossy) continue;
        // The room's triangles are coarser than pixels: the picture's own detail rides on what they carry.
        const Rgb b(radiance.data[3 * i], radiance.data[3 * i + 1], radiance.data[3 * i + 2]);
        const Rgb detail = (b / point.before.max(1e-5f)).max(kLeastDetail).min(kMostDetail);
        p.albedo = (point.surface.look.diffuse * detail).min(1.0f);
      }
    }
  });
  return seen;
}

}  // namespace lumigraft::rays
