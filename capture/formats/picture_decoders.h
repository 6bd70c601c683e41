#pragma once
// The decoders of picture_file.h and coded_picture.h. Functions throw InputError with the reason alone.
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "capture/formats/picture_file.h"

namespace lumigraft::capture {

/// PNG through libpng, without its messages on the terminal.
bool is_png(const std::vector<std::uint8_t>& start);
PictureHeader png_header(const std::vector<std::uint8_t>& start);
Image<std::uint8_t> decode_png8(const std::vector<std::uint8_t>& bytes);    ///< R G B, alpha dropped
Image<std::uint16_t> decode_png16(const std::vector<std::uint8_t>& bytes);  ///< grey

/// As decode_coded_picture.
Image<std::uint8_t> decode_any_png(std::span<const std::uint8_t> bytes, int max_edge);
Image<std::uint8_t> decode_tiff(std::span<const std::uint8_t> bytes, int max_edge);

/// OpenEXR: channels R, G and B of the first part, as 32-bit floats.
bool is_exr(const std::vector<std::uint8_t>& start);
PictureHeader exr_header(const std::filesystem::path& path);
Image<float> decode_exr(const std::filesystem::path& path);

/// Radiance HDR (Ward 1991, "Real Pixels"; the Radiance file formats reference).
bool is_hdr(const std::vector<std::uint8_t>& start);
PictureHeader hdr_header(const std::vector<std::uint8_t>& start);
/// Radiance divided by the factors of the file's EXPOSURE lines, which were multiplied into its pixels.
Image<float> decode_hdr(const std::vector<std::uint8_t>& bytes);

}  // namespace lumigraft::capture
