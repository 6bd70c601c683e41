#include "relight/rays/pixel_surfaces.h"

#include <limits>

#include "relight/rays/threads.h"

namespace lumigraft::rays {
namespace {

using Eigen::Vector3f;

constexpr float kLeastDetail = 0.2f, kMostDetail = 4;  // of a pixel against what is around it

}  // namespace

PixelRays::PixelRays(const CameraModel& camera) : across_(camera.width + 1) {
  corners_.reserve(static_cast<std::size_t>(across_) * static_cast<std::size_t>(camera.height + 1));
  for (int v = 0; v <= camera.height; ++v) {
    for (int u = 0; u <= camera.width; ++u) {
      const auto w = camera.unproject({u - 0.5, v - 0.5});
      corners_.push_back(w ? w->normalized().cast<float>().eval()
                           : Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()).eval());
    }
  }
}

Vector3f PixelRays::at(int u, int v, const Eigen::Vector2f& within) const {
  const Vector3f* top =
      &corners_[static_cast<std::size_t>(v) * static_cast<std::size_t>(across_) + static_cast<std::size_t>(u)];
  const Vector3f* bottom = top + across_;
  const float x = within.x(), y = within.y();
  const Vector3f w = (1 - y) * ((1 - x) * top[0] + x * top[1]) + y * ((1 - x) * bottom[0] + x * bottom[1]);
  const float length = w.norm();
  return length > 0 ? (w / length).eval() : Vector3f::Zero().eval();  // NaN is none either
}

std::vector<PixelSurface> see_room(const RayRoom& room, const Eye& eye, const Image<float>& radiance) {
  const int width = eye.camera.model.width, height = eye.camera.model.height;
  const Vector3f eye_m = eye.camera.T_tag_camera.translation();
  std::vector<PixelSurface> seen(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for_each_block(height, 4, [&](int first, int last) {
    for (int v = first; v < last; ++v) {
      for (int u = 0; u < width; ++u) {
        const std::size_t i =
            static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u);
        PixelSurface& p = seen[i];
        p.w = eye.ray(u, v);
        if (p.w.isZero(0)) continue;
        const auto hit = room.meshes().hit(eye_m, p.w, std::numeric_limits<float>::infinity());
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
