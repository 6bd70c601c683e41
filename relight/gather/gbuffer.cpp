#include "relight/gather/gbuffer.h"

#include <array>

#include "relight/gather/parameters.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

/// `hit`: null if there is none. `radiance`: of the camera at this pixel.
GBufferPixel pixel_of(const RayRoom& room, const Vector3f& w, const MeshHit* hit, const Rgb& radiance) {
  GBufferPixel p;
  p.w = w;
  if (!hit) return p;
  const RealPoint point = room.point(*hit, w);
  p.known = true;
  p.glossy = !point.is_even();
  const RoomFacet* facet = room.facet(*hit);
  p.modelled = facet && !facet->fused;
  p.surface = point.surface;
  p.depth_m = hit->t_m;
  if (p.glossy) return p;
  // The room's triangles are coarser than pixels: the image's detail modulates their values.
  p.before = point.before;
  p.albedo = detailed(point.surface.bsdf.diffuse, radiance, point.before);
  return p;
}

}  // namespace

Rgb detail_of(const Rgb& radiance, const Rgb& radiance_similar) {
  return (radiance / radiance_similar.max(1e-5f)).max(kGather.min_detail).min(kGather.max_detail);
}

Rgb detailed(const Rgb& albedo, const Rgb& radiance, const Rgb& radiance_similar) {
  return (albedo * detail_of(radiance, radiance_similar)).min(1.0f);
}

void trace_room(const RayRoom& room, const CameraRays& eye, const capture::Image<float>& radiance,
                std::vector<GBufferPixel>& seen) {
  const int width = eye.camera.model.width, height = eye.camera.model.height;
  RayFan all;
  all.from_m = eye.camera.T_tag_camera.translation();
  all.limit_m.fill(std::numeric_limits<float>::infinity());
  seen.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for_each_block(height, 4, [&](int first, int last) {
    RayFan fan = all;
    std::array<MeshHit, RayFan::kMaxRays> hits;
    for (int v = first; v < last; ++v) {
      for (int from = 0; from < width; from += RayFan::kMaxRays) {
        const int count = std::min(width - from, RayFan::kMaxRays);
        fan.some = 0;
        for (int k = 0; k < count; ++k) {
          fan.w[static_cast<std::size_t>(k)] = eye.ray(from + k, v);
          if (!fan.w[static_cast<std::size_t>(k)].isZero(0)) fan.some |= 1u << k;
        }
        const std::uint32_t met = room.meshes().hits(fan, hits, Coverage::by_chance);
        for (int k = 0; k < count; ++k) {
          const std::size_t i = static_cast<std::size_t>(v) * width + from + k;
          seen[i] = pixel_of(room, fan.w[static_cast<std::size_t>(k)],
                             met >> k & 1 ? &hits[static_cast<std::size_t>(k)] : nullptr, radiance_at(radiance, i));
        }
      }
    }
  });
}

std::optional<GBufferPixel> room_behind(const RayRoom& room, const CameraRays& eye, const CurrentDepth& depth, int u,
                                        int v, float front_m, const Rgb& radiance) {
  const float depth_m = depth.at(u, v), limit_m = depth_m + depth.allowed_m(depth_m, 0);
  const Vector3f w = eye.ray(u, v), eye_m = eye.camera.T_tag_camera.translation();
  float passed_m = front_m;
  for (int surfaces = 0; surfaces < kGather.gone_surfaces; ++surfaces) {
    passed_m += kGather.lift_m;
    auto hit = room.meshes().hit(eye_m + passed_m * w, w, limit_m - passed_m);
    if (!hit) return std::nullopt;
    passed_m = hit->t_m += passed_m;
    const float cosine = -room.meshes().surface(*hit, w).normal.dot(w);
    if (std::abs(passed_m - depth_m) <= depth.allowed_m(depth_m, cosine)) return pixel_of(room, w, &*hit, radiance);
  }
  return std::nullopt;
}

}  // namespace lumigraft::relight
