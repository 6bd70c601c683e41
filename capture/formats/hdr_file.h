#pragma once
// Reads Radiance HDR (Ward 1991, "Real Pixels"; the Radiance file formats reference). Functions throw InputError with
// the reason alone.
#include <cstdint>
#include <vector>

#include "capture/formats/picture_file.h"

namespace lumigraft::capture {

bool is_hdr(const std::vector<std::uint8_t>& start);
PictureHeader hdr_header(const std::vector<std::uint8_t>& start);
/// Radiance divided by the factors of the file's EXPOSURE lines, which were multiplied into its pixels.
Image<float> decode_hdr(const std::vector<std::uint8_t>& bytes);

}  // namespace lumigraft::capture
