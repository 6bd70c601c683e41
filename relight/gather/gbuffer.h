#pragma once
// G-buffer: the real surface at each pixel.
#include "capture/image.h"
#include "relight/gather/ray_room.h"
#include "relight/tracing/posed_camera.h"

namespace lumigraft::relight {

struct GBufferPixel {
  bool known = false;   ///< a surface exists
  bool glossy = false;  ///< of known material with a directional (glossy) part
  SurfaceHit surface;
  Eigen::Vector3f w = Eigen::Vector3f::Zero();  ///< unit, from the camera
  float depth_m = 0;                            ///< along w
  Rgb albedo = Rgb::Zero();                     ///< per pixel, finer than the room's; unset if glossy
};

/// View directions of pixels, computed at the pixels' corners, linear between.
class PixelRays {
 public:
  explicit PixelRays(const capture::CameraModel& camera);
  /// Unit, camera frame; `within`: position in the pixel, [0, 1)². Zero if the camera has no ray there.
  Eigen::Vector3f at(int u, int v, const Eigen::Vector2f& within = {0.5f, 0.5f}) const;

 private:
  int across_;
  std::vector<Eigen::Vector3f> corners_;  ///< unit; NaN if there is no ray
};

struct CameraRays {
  const PixelRays& rays;
  PosedCamera camera;

  Eigen::Vector3f ray(int u, int v, const Eigen::Vector2f& within = {0.5f, 0.5f}) const {
    return camera.T_tag_camera.linear() * rays.at(u, v, within);
  }
};

/// Traces a ray through every pixel's centre and writes the result to `seen`. `radiance`: the camera image, linear,
/// W/sr/m².
void trace_room(const RayRoom& room, const CameraRays& eye, const capture::Image<float>& radiance,
                std::vector<GBufferPixel>& seen);

}  // namespace lumigraft::relight
