#pragma once
// What every pixel shows of the room.
#include "capture/image.h"
#include "relight/gather/ray_room.h"
#include "relight/tracing/posed_camera.h"

namespace lumigraft::relight {

struct GBufferPixel {
  bool known = false;   ///< there is a surface
  bool glossy = false;  ///< a known one, which sends light on by direction
  SurfaceHit surface;
  Eigen::Vector3f w = Eigen::Vector3f::Zero();  ///< unit, from the camera
  float depth_m = 0;                            ///< along w
  Rgb albedo = Rgb::Zero();                     ///< of the pixel, finer than the room's; unless glossy
};

/// Directions in which pixels look, known at their corners; linear between.
class PixelRays {
 public:
  explicit PixelRays(const capture::CameraModel& camera);
  /// Unit, camera frame; `within` [0, 1)² of the pixel's square. Zero if the camera has no ray there.
  Eigen::Vector3f at(int u, int v, const Eigen::Vector2f& within = {0.5f, 0.5f}) const;

 private:
  int across_;
  std::vector<Eigen::Vector3f> corners_;  ///< unit; NaN where there is no ray
};

struct CameraRays {
  const PixelRays& rays;
  PosedCamera camera;

  Eigen::Vector3f ray(int u, int v, const Eigen::Vector2f& within = {0.5f, 0.5f}) const {
    return camera.T_tag_camera.linear() * rays.at(u, v, within);
  }
};

/// By pixel, through its centre, into `seen`. `radiance`: the camera picture, linear, W/sr/m².
void trace_room(const RayRoom& room, const CameraRays& eye, const capture::Image<float>& radiance,
                std::vector<GBufferPixel>& seen);

}  // namespace lumigraft::relight
