#pragma once
// Reads OpenEXR: channels R, G and B of the first part, as 32-bit floats. Functions throw InputError with the reason
// alone.
#include <cstdint>
#include <filesystem>
#include <vector>

#include "capture/formats/picture_file.h"

namespace lumigraft::capture {

bool is_exr(const std::vector<std::uint8_t>& start);
PictureHeader exr_header(const std::filesystem::path& path);
Image<float> decode_exr(const std::filesystem::path& path);

}  // namespace lumigraft::capture
