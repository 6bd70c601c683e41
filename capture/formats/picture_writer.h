#pragma once
// Pictures to files: PNG without loss, EXR in floats. The same picture gives the same bytes.
#include <filesystem>

#include "capture/image.h"

namespace lumigraft::capture {

/// 8-bit RGB, marked as sRGB. Throws std::runtime_error, as on a full disk.
void write_png(const std::filesystem::path& path, const Image<std::uint8_t>& rgb);

/// 16-bit grey.
void write_png(const std::filesystem::path& path, const Image<std::uint16_t>& grey);

/// 32-bit floats; one channel is named Y, three R G B.
void write_exr(const std::filesystem::path& path, const Image<float>& image);

}  // namespace lumigraft::capture
