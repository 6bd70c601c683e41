#pragma once
// Writes OpenEXR files for tests: 32-bit floats, channels R G B, or Y alone.
#include <filesystem>

#include "capture/image.h"

namespace lumigraft::test {

void write_exr(const std::filesystem::path& file, const capture::Image<float>& image);

}  // namespace lumigraft::test
