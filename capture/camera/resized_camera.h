#pragma once
// The same view at another image size.
#include "capture/camera/camera_model.h"

namespace lumigraft::capture {

/// `factor`: pixels of the result along a pixel of the camera. Directions of corners of pixels are kept: pixel centres
/// are at integers, so that the principal point moves by half a pixel of each.
inline CameraModel resized(CameraModel camera, double factor, int width, int height) {
  camera.width = width;
  camera.height = height;
  camera.fx *= factor;
  camera.fy *= factor;
  camera.cx = (camera.cx + 0.5) * factor - 0.5;
  camera.cy = (camera.cy + 0.5) * factor - 0.5;
  return camera;
}

}  // namespace lumigraft::capture
