#pragma once
// Pictures of sessions with more or fewer pixels, for what they cost.
#include "capture/camera/camera_model.h"
#include "capture/frame.h"

namespace lumigraft::server {

/// The colour camera's picture and its depth, and the camera, with `factor` times as many pixels along each edge.
/// Nearest pixels: what matters is their number.
void resize_picture(double factor, capture::CameraModel& camera, capture::FrameSet& frame);

/// Each pixel the mean light of factor² pixels, sRGB codes.
capture::Image<std::uint8_t> shrunk(const capture::Image<std::uint8_t>& srgb, int factor);

}  // namespace lumigraft::server
