#pragma once
// G-buffer: the real surface at each pixel.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "capture/image.h"
#include "relight/compose/current_depth.h"
#include "relight/compose/rgb_image.h"
#include "relight/gather/ray_room.h"
#include "relight/tracing/parallel_for.h"
#include "relight/tracing/trace_scene.h"

namespace lumigraft::relight {

struct GBufferPixel {
  bool known = false;  ///< a surface exists
  /// Of the enclosure, which no depth camera saw: what is seen there may be nearer, where depth has a hole.
  bool modelled = false;
  bool glossy = false;  ///< of known material with a directional (glossy) part
  SurfaceHit surface;
  Eigen::Vector3f w = Eigen::Vector3f::Zero();  ///< unit, from the camera
  float depth_m = 0;                            ///< along w
  Rgb albedo = Rgb::Zero();                     ///< per pixel, finer than the room's; unset if glossy
  Rgb before = Rgb::Zero();                     ///< of the room's surface there, W/sr/m²; zero: not known
};

using MovedPixels = std::vector<std::pair<std::size_t, GBufferPixel>>;  ///< by pixel index, ascending

/// The room's G-buffer at a fraction of the image size: a pixel represents a square of scale × scale pixels of the
/// camera.
struct RoomPixels {
  const std::vector<GBufferPixel>& seen;
  const capture::CameraModel& camera;  ///< of the smaller image
  int scale;

  const GBufferPixel& at(int u, int v) const {  ///< at a pixel of the camera
    return seen[static_cast<std::size_t>(v / scale) * static_cast<std::size_t>(camera.width) +
                static_cast<std::size_t>(u / scale)];
  }
};

struct CameraRays {
  const PixelRays& rays;
  PosedCamera camera;

  Eigen::Vector3f ray(int u, int v, const Eigen::Vector2f& within = {0.5f, 0.5f}) const {
    return camera.T_tag_camera.linear() * rays.at(u, v, within);
  }
};

/// Squares of pixels of an image.
class TileMask {
 public:
  static constexpr int kEdge = 8;  ///< pixels

  TileMask() = default;  ///< of no image
  TileMask(int width, int height, bool all)
      : across_((width + kEdge - 1) / kEdge),
        down_((height + kEdge - 1) / kEdge),
        some_(static_cast<std::size_t>(across_) * static_cast<std::size_t>(down_), all) {}

  int across() const { return across_; }
  int down() const { return down_; }
  bool tile(int x, int y) const { return some_[index(x, y)] != 0; }
  void set(int x, int y) { some_[index(x, y)] = 1; }
  bool has(int u, int v) const { return tile(u / kEdge, v / kEdge); }  ///< of a pixel
  bool has_all() const {
    return !some_.empty() && std::all_of(some_.begin(), some_.end(), [](std::uint8_t tile) { return tile != 0; });
  }
  bool has_all_of(const TileMask& other) const {
    return some_.size() == other.some_.size() &&
           std::equal(some_.begin(), some_.end(), other.some_.begin(), std::greater_equal<>());
  }

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(across_) + static_cast<std::size_t>(x);
  }
  int across_ = 0, down_ = 0;
  std::vector<std::uint8_t> some_;
};

/// Calls `work(u, v)` for each pixel of an image in `tiles`, `rows` rows at a time on a thread.
template <typename Work>
void for_each_pixel(const TileMask& tiles, int width, int height, int rows, Work work) {
  for_each_index(height, rows, [&](int v) {
    for (int x = 0; x < tiles.across(); ++x) {
      if (!tiles.tile(x, v / TileMask::kEdge)) continue;
      for (int u = x * TileMask::kEdge; u < std::min((x + 1) * TileMask::kEdge, width); ++u) work(u, v);
    }
  });
}

/// Traces a ray through the centre of every pixel in `tiles` and writes the result to `seen`; of all other pixels `w`
/// is zero. `radiance`: the camera image, linear, W/sr/m².
void trace_room(const RayRoom& room, const CameraRays& eye, const capture::Image<float>& radiance,
                const TileMask& tiles, std::vector<GBufferPixel>& seen);

/// One pixel of every tile of the image, as trace_room finds it.
struct TilePixels {
  std::vector<GBufferPixel> seen;  ///< row by row
  capture::CameraModel camera;     ///< only its size and focal lengths are valid

  static int pixel_of(int tile, int size) { return std::min(tile * TileMask::kEdge + TileMask::kEdge / 2, size - 1); }
  static bool has(int u, int v, const capture::CameraModel& image) {  ///< whether it is the one of its tile
    return u == pixel_of(u / TileMask::kEdge, image.width) && v == pixel_of(v / TileMask::kEdge, image.height);
  }
  const GBufferPixel& at(int u, int v) const {  ///< of a pixel's tile
    return seen[static_cast<std::size_t>(v / TileMask::kEdge * camera.width + u / TileMask::kEdge)];
  }
};
TilePixels trace_tiles(const RayRoom& room, const CameraRays& eye, const capture::Image<float>& radiance);

/// The room's surface along a pixel's ray behind surface at `front_m` that the camera sees through, if `depth` does not
/// differ from it; empty: there is none.
std::optional<GBufferPixel> room_behind(const RayRoom& room, const CameraRays& eye, const CurrentDepth& depth, int u,
                                        int v, float front_m, const Rgb& radiance);

/// The pixel nearest to the central one of the square (x, y) of `edge` × `edge` pixels among those that count; -1:
/// none.
template <typename Counts>
int central_pixel(const std::vector<GBufferPixel>& seen, const capture::CameraModel& camera, int edge, int x, int y,
                  Counts counts) {
  const int middle = central_offset(edge);
  int nearest = -1, least = std::numeric_limits<int>::max();
  for (int v = y * edge; v < std::min((y + 1) * edge, camera.height); ++v) {
    for (int u = x * edge; u < std::min((x + 1) * edge, camera.width); ++u) {
      const int pixel = v * camera.width + u;
      const int du = u - x * edge - middle, dv = v - y * edge - middle, off = du * du + dv * dv;
      if (!counts(seen[static_cast<std::size_t>(pixel)]) || off >= least) continue;
      least = off;
      nearest = pixel;
    }
  }
  return nearest;
}

/// Albedo of a similar pixel, modulated by the image's detail: the radiance of the pixel over that of the similar one.
Rgb detailed(const Rgb& albedo, const Rgb& radiance, const Rgb& radiance_similar);
/// The bounded ratio.
Rgb detail_of(const Rgb& radiance, const Rgb& radiance_similar);

}  // namespace lumigraft::relight
