#pragma once
// Fusion of a real capture: time, surface and memory.
#include <filesystem>

namespace lumigraft::test {

/// Fuses all frames of a folder (seven_scenes.h) at the default settings, with their poses, and prints a line.
void measure_capture(const std::filesystem::path& folder);

}  // namespace lumigraft::test
