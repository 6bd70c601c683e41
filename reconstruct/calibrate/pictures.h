#pragma once
// Pictures for calibration: a folder of PNG, JPEG, TIFF or BMP files taken with other software, and their linear light.
//
// At an edge of a print, a pixel mixes ink and paper by area, which holds for linear light only: in encoded values a
// blurred edge is shifted a quarter of a pixel towards the dark side.
#include <filesystem>
#include <vector>

#include "capture/camera/response.h"
#include "capture/frame.h"

namespace lumigraft::reconstruct {

/// Sorted by name. Throws InputError where the folder has no pictures.
std::vector<std::filesystem::path> picture_files(const std::filesystem::path& folder);

/// R G B with 8 bits per channel; grey is replicated. Orientation metadata is ignored: pixels as the sensor recorded
/// them. Throws InputError.
capture::Frame read_any_picture(const std::filesystem::path& file);

/// Linear luminance; 65534 is the picture's maximum. The lowest bit is set where some channel is clipped: the value is
/// a lower bound.
capture::Image<std::uint16_t> linear_light(const capture::Frame& picture, const capture::Response& response);

inline bool is_cut(std::uint16_t light) { return (light & 1) != 0; }

}  // namespace lumigraft::reconstruct
