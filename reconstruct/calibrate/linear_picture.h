#pragma once
// Linear luminance of a picture in 16 bits, for calibration.
//
// At an edge of a print, a pixel mixes ink and paper by area, which holds for linear light only: in encoded values a
// blurred edge is shifted a quarter of a pixel towards the dark side.
#include "capture/camera/response.h"
#include "capture/frame.h"

namespace lumigraft::reconstruct {

/// Linear luminance; 65534 is the picture's maximum. The lowest bit is set where some channel is clipped: the value is
/// a lower bound.
capture::Image<std::uint16_t> linear_light(const capture::Frame& picture, const capture::Response& response);

inline bool is_cut(std::uint16_t light) { return (light & 1) != 0; }

}  // namespace lumigraft::reconstruct
