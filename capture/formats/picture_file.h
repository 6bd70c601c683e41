#pragma once
// Reads one image file: PNG, OpenEXR or Radiance HDR. All functions throw InputError with the reason alone
// ("found 8 bits a channel, allowed: 16"); the caller adds the list and line that name the file.
#include <cstdint>
#include <filesystem>

#include "capture/image.h"

namespace lumigraft::capture {

/// Larger images are refused: a damaged header would ask for gigabytes. Well above any camera here.
inline constexpr int kMaxSide_px = 16384;

struct PictureHeader {
  enum class Format { png, exr, hdr };
  Format format = Format::png;
  int width = 0, height = 0;
  int bits = 0;       ///< per channel
  bool gray = false;  ///< PNG of one channel, without alpha or palette

  bool holds_radiance() const { return format != Format::png; }
};

PictureHeader read_picture_header(const std::filesystem::path& path);

Image<std::uint8_t> read_encoded(const std::filesystem::path& path);  ///< 8-bit PNG as R G B
Image<std::uint16_t> read_depth(const std::filesystem::path& path);   ///< 16-bit grey PNG
Image<float> read_radiance(const std::filesystem::path& path);        ///< EXR or HDR as R G B

}  // namespace lumigraft::capture
