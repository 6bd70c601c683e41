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

/// Pixels that are traced together.
class Packet {
 public:
  Packet(const RayRoom& room, const CameraRays& eye) : room_(room), eye_(eye) {
    fan_.from_m = eye.camera.T_tag_camera.translation();
    fan_.limit_m.fill(std::numeric_limits<float>::infinity());
  }

  /// `place`: what `write` gets with the pixel (u, v). True if the packet is full.
  bool add(int place, int u, int v, const capture::Image<float>& radiance) {
    places_[count_] = place;
    radiance_[count_] = radiance_at(radiance, static_cast<std::size_t>(v * radiance.width + u));
    fan_.w[count_] = eye_.ray(u, v);
    if (!fan_.w[count_].isZero(0)) fan_.some |= 1u << count_;
    return ++count_ == RayFan::kMaxRays;
  }
  /// Calls `write(place, pixel)` for all that was added, and empties the packet.
  template <typename Write>
  void trace(Write write) {
    if (count_ == 0) return;
    const std::uint32_t met = room_.meshes().hits(fan_, hits_, Coverage::by_chance);
    for (std::size_t k = 0; k < count_; ++k)
      write(places_[k], pixel_of(room_, fan_.w[k], met >> k & 1 ? &hits_[k] : nullptr, radiance_[k]));
    count_ = 0;
    fan_.some = 0;
  }

 private:
  const RayRoom& room_;
  const CameraRays& eye_;
  RayFan fan_;
  std::array<MeshHit, RayFan::kMaxRays> hits_;
  std::array<int, RayFan::kMaxRays> places_;
  std::array<Rgb, RayFan::kMaxRays> radiance_;
  std::size_t count_ = 0;
};

}  // namespace

Rgb detail_of(const Rgb& radiance, const Rgb& radiance_similar) {
  return (radiance / radiance_similar.max(1e-5f)).max(kGather.min_detail).min(kGather.max_detail);
}

Rgb detailed(const Rgb& albedo, const Rgb& radiance, const Rgb& radiance_similar) {
  return (albedo * detail_of(radiance, radiance_similar)).min(1.0f);
}

void trace_room(const RayRoom& room, const CameraRays& eye, const capture::Image<float>& radiance,
                const TileMask& tiles, std::vector<GBufferPixel>& seen) {
  const int width = eye.camera.model.width, height = eye.camera.model.height;
  seen.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for_each_index(height, 4, [&](int v) {
    Packet packet(room, eye);
    const auto row = static_cast<std::size_t>(v) * static_cast<std::size_t>(width);
    const auto write = [&](int u, const GBufferPixel& pixel) { seen[row + static_cast<std::size_t>(u)] = pixel; };
    for (int u = 0; u < width; ++u) {
      GBufferPixel& pixel = seen[row + static_cast<std::size_t>(u)];
      if (!tiles.has(u, v)) {
        if (!pixel.w.isZero(0)) pixel = GBufferPixel();
      } else if (packet.add(u, u, v, radiance)) {
        packet.trace(write);
      }
    }
    packet.trace(write);
  });
}

TilePixels trace_tiles(const RayRoom& room, const CameraRays& eye, const capture::Image<float>& radiance) {
  const capture::CameraModel& camera = eye.camera.model;
  TilePixels tiles;
  tiles.camera = camera;
  tiles.camera.width = (camera.width + TileMask::kEdge - 1) / TileMask::kEdge;
  tiles.camera.height = (camera.height + TileMask::kEdge - 1) / TileMask::kEdge;
  tiles.camera.fx /= TileMask::kEdge;
  tiles.camera.fy /= TileMask::kEdge;
  tiles.seen.resize(static_cast<std::size_t>(tiles.camera.width) * static_cast<std::size_t>(tiles.camera.height));
  for_each_index(tiles.camera.height, 1, [&](int y) {
    Packet packet(room, eye);
    const auto write = [&](int x, const GBufferPixel& pixel) {
      tiles.seen[static_cast<std::size_t>(y * tiles.camera.width + x)] = pixel;
    };
    for (int x = 0; x < tiles.camera.width; ++x) {
      const int u = TilePixels::pixel_of(x, camera.width), v = TilePixels::pixel_of(y, camera.height);
      if (packet.add(x, u, v, radiance)) packet.trace(write);
    }
    packet.trace(write);
  });
  return tiles;
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
