#pragma once
// Pictures as the bytes of files: 8 bits per channel; 1 channel is grey, 3 are R G B, 4 are R G B A.
#include <cstdint>
#include <string>

#include "capture/image.h"

namespace lumigraft::test {

std::string png_bytes(const capture::Image<std::uint8_t>& picture);
std::string jpeg_bytes(const capture::Image<std::uint8_t>& rgb);
std::string webp_bytes(const capture::Image<std::uint8_t>& rgb_or_rgba);  ///< lossless

}  // namespace lumigraft::test
