#pragma once
// Decodes pictures in the usual formats of files: PNG, JPEG, WebP, TIFF, BMP, PNM, Sun raster and JPEG 2000.
//
// Each by the library of its format, not by one for all formats: OpenCV's loads GDAL and 70 more libraries into every
// process, which takes longer than most pictures.
#include <cstdint>
#include <span>

#include "capture/image.h"

namespace lumigraft::capture {

/// Throws InputError, the reason alone, if there are more pixels along an edge.
void refuse_large_picture(std::int64_t width, std::int64_t height, int max_edge);

/// R G B or R G B A, 8 bits per channel as stored: orientation and colour profiles are ignored, grey is replicated, 16
/// bits are rounded. Alpha is that of PNG and WebP. Empty if the bytes cannot be decoded. Throws InputError, the reason
/// alone, if the picture is larger than `max_edge`, before any pixel is decoded.
Image<std::uint8_t> decode_coded_picture(std::span<const std::uint8_t> bytes, int max_edge);

/// Its R G B.
Image<std::uint8_t> without_alpha(Image<std::uint8_t> picture);

}  // namespace lumigraft::capture
