#pragma once
// Calibration pictures that somebody took with a camera's own program: a folder of PNG, JPEG, TIFF or BMP files.
#include <filesystem>
#include <vector>

#include "capture/frame.h"

namespace lumigraft::reconstruct {

/// In the order of their names. Throws InputError where the folder holds no picture.
std::vector<std::filesystem::path> picture_files(const std::filesystem::path& folder);

/// 8 bits a channel as R G B; a grey picture three times. Turned as the sensor saw it. Throws InputError.
capture::Picture read_any_picture(const std::filesystem::path& file);

}  // namespace lumigraft::reconstruct
