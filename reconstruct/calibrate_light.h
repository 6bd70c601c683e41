#pragma once
// A picture as calibration keeps it: how much light every pixel got, in 16 bits.
//
// Edges of a print lie where a pixel mixes ink and paper by area, and that holds for light alone: in code values a
// blurred edge lies a quarter of a pixel towards the dark.
#include "capture/frame.h"
#include "capture/response.h"

namespace lumigraft {

/// Linear luminance; the brightest that the picture can hold is 65535.
Image<std::uint16_t> linear_light(const Picture& picture, const Response& response);

}  // namespace lumigraft
