#pragma once
// Reads PNG through libpng, without its messages on the terminal. Functions throw InputError with the reason alone.
#include <cstdint>
#include <vector>

#include "capture/formats/picture_file.h"

namespace lumigraft::capture {

bool is_png(const std::vector<std::uint8_t>& start);
PictureHeader png_header(const std::vector<std::uint8_t>& start);
Image<std::uint8_t> decode_png8(const std::vector<std::uint8_t>& bytes);    ///< R G B, alpha dropped
Image<std::uint16_t> decode_png16(const std::vector<std::uint8_t>& bytes);  ///< grey

}  // namespace lumigraft::capture
