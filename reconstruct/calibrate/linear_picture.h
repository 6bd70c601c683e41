#pragma once
// A picture as calibration keeps it: how much light every pixel got, in 16 bits.
//
// Edges of a print lie where a pixel mixes ink and paper by area, and that holds for light alone: in code values a
// blurred edge lies a quarter of a pixel towards the dark.
#include "capture/camera/response.h"
#include "capture/frame.h"

namespace lumigraft::reconstruct {

/// Linear luminance; the brightest that the picture can hold is 65534. The last bit is set where the picture ends, in
/// some channel: the light is that or more.
capture::Image<std::uint16_t> linear_light(const capture::Picture& picture, const capture::Response& response);

inline bool is_cut(std::uint16_t light) { return (light & 1) != 0; }

}  // namespace lumigraft::reconstruct
