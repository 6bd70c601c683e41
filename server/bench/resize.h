#pragma once
// Resamples pictures of sessions to measure cost against resolution.
#include "capture/camera/camera_model.h"
#include "capture/frame.h"

namespace lumigraft::server {

/// Resamples the colour picture, its depth and the camera model by `factor` along each edge. Nearest neighbour: only
/// the number of pixels matters for the cost.
void resize_picture(double factor, capture::CameraModel& camera, capture::FrameSet& frame);

/// Box filter over factor² pixels in linear light; 8-bit sRGB in and out.
capture::Image<std::uint8_t> shrunk(const capture::Image<std::uint8_t>& srgb, int factor);

}  // namespace lumigraft::server
