#pragma once
// Displacement of static surfaces in the picture of a moving camera.
#include <Eigen/Geometry>
#include <optional>

#include "capture/camera/camera_model.h"
#include "capture/image.h"

namespace lumigraft::relight {

/// From where a frame was taken.
struct Viewpoint {
  capture::CameraModel camera;
  Eigen::Isometry3d T_tag_camera = Eigen::Isometry3d::Identity();
  const capture::Image<float>* depth_m = nullptr;  ///< along z, of the camera's size, 0: unknown; null: not measured
};

/// From the pixel to where an earlier frame shows the same surface, pixels. Where depth is unknown the surface is the
/// plane of the tag. Empty where that is not seen either, or was not in front of the camera.
std::optional<Eigen::Vector2d> shift_px(const Viewpoint& now, const Eigen::Isometry3d& T_tag_camera_before,
                                        const Eigen::Vector2i& pixel);

}  // namespace lumigraft::relight
