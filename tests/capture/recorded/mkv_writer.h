#pragma once
// Writes Matroska files for tests with libav's own encoders.
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "capture/image.h"

namespace lumigraft::test {

struct TimedRgb {
  std::int64_t time_ms = 0;
  capture::Image<std::uint8_t> rgb;
};

struct TimedCounts {
  std::int64_t time_ms = 0;
  capture::Image<std::uint16_t> counts;
};

/// codec: "ffv1" (lossless, bgr0) or "mjpeg" (yuvj444p, quality 2).
void write_color_mkv(const std::filesystem::path& file, const std::string& codec,
                     const std::vector<TimedRgb>& pictures);
void write_depth_mkv(const std::filesystem::path& file, const std::vector<TimedCounts>& pictures);

}  // namespace lumigraft::test
