#pragma once
// What every pixel shows of the room.
#include "capture/image.h"
#include "relight/rays/ray_room.h"
#include "relight/reference/delta_path_tracer.h"

namespace lumigraft::rays {

struct PixelSurface {
  bool known = false;   ///< there is a surface
  bool glossy = false;  ///< a known one, which sends light on by direction
  reference::Surface surface;
  Eigen::Vector3f w = Eigen::Vector3f::Zero();  ///< unit, from the camera
  float depth_m = 0;                            ///< along w
  Rgb albedo = Rgb::Zero();                     ///< of the pixel, finer than the room's; unless glossy
};

/// By pixel, through its centre. `radiance`: the camera picture, linear, W/sr/m².
std::vector<PixelSurface> see_room(const RayRoom& room, const ReferenceCamera& camera, const Image<float>& radiance);

/// Through a point of the pixel's square, `within` [0, 1)²; zero if the camera has no ray there.
Eigen::Vector3f camera_ray(const ReferenceCamera& camera, int u, int v, const Eigen::Vector2f& within);

}  // namespace lumigraft::rays
