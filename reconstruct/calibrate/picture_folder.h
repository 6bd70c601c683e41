#pragma once
// Reads calibration pictures taken with other software: a folder of PNG, JPEG, TIFF or BMP files.
#include <filesystem>
#include <vector>

#include "capture/frame.h"

namespace lumigraft::reconstruct {

/// Sorted by name. Throws InputError where the folder has no pictures.
std::vector<std::filesystem::path> picture_files(const std::filesystem::path& folder);

/// R G B with 8 bits per channel; grey is replicated. Orientation metadata is ignored: pixels as the sensor recorded
/// them. Throws InputError.
capture::Frame read_any_picture(const std::filesystem::path& file);

}  // namespace lumigraft::reconstruct
