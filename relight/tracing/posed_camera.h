#pragma once
// A camera and its pose.
#include <Eigen/Geometry>

#include "capture/camera/camera_model.h"

namespace lumigraft::relight {

struct PosedCamera {
  capture::CameraModel model;
  Eigen::Isometry3f T_tag_camera = Eigen::Isometry3f::Identity();
};

}  // namespace lumigraft::relight
