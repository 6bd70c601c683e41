#pragma once
// The camera's picture as the radiance of real surfaces that it shows: finer than the fused room, and of this moment.
#include <cmath>
#include <optional>
#include <vector>

#include "relight/gather/gbuffer.h"

namespace lumigraft::relight {

class SeenRadiance {
 public:
  /// Keeps references. `seen`: per pixel of the camera. `radiance`: without objects, W/sr/m². `near_m`: between a
  /// surface of the room and the same one in `seen`.
  SeenRadiance(const std::vector<GBufferPixel>& seen, const capture::Image<float>& radiance, const PosedCamera& camera,
               float near_m)
      : seen_(seen),
        radiance_(radiance),
        camera_(camera.model),
        T_camera_tag_(camera.T_tag_camera.inverse()),
        near_m_(near_m) {}

  /// Towards the camera, bilinear over the pixels that show the point; none: another surface hides it, or it is not in
  /// the picture.
  std::optional<Rgb> at(const Eigen::Vector3f& p_m) const;

 private:
  const std::vector<GBufferPixel>& seen_;
  const capture::Image<float>& radiance_;
  capture::CameraModel camera_;
  Eigen::Isometry3f T_camera_tag_;
  float near_m_;
};

}  // namespace lumigraft::relight
