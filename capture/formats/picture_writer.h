#pragma once
// Writes image files: PNG and EXR. The same image always gives the same bytes.
#include <filesystem>

#include "capture/image.h"

namespace lumigraft::capture {

/// 8-bit RGB, marked as sRGB. Throws std::runtime_error, for example if the disk is full.
void write_png(const std::filesystem::path& path, const Image<std::uint8_t>& rgb);

/// 16-bit grey.
void write_png(const std::filesystem::path& path, const Image<std::uint16_t>& grey);

/// 32-bit floats. The channels are named Y, or R G B.
void write_exr(const std::filesystem::path& path, const Image<float>& image);

}  // namespace lumigraft::capture
