#pragma once
// Writes PNG files for tests: 8 or 16 bits per channel; 1 channel is grey, 3 are R G B, 4 are R G B A.
#include <cstdint>
#include <filesystem>

#include "capture/image.h"

namespace lumigraft::test {

void write_png(const std::filesystem::path& file, const capture::Image<std::uint8_t>& image);
void write_png(const std::filesystem::path& file, const capture::Image<std::uint16_t>& image);

}  // namespace lumigraft::test
