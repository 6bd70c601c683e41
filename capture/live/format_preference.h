#pragma once
#include "capture/formats/pixel_format.h"

namespace lumigraft::capture {

/// Order in which V4L2 and libcamera choose a format if the session names none: colour before grey, uncompressed before
/// JPEG, and interpolated colour before Bayer.
inline constexpr PixelFormat kPreferredFormats[] = {
    PixelFormat::yuyv,        PixelFormat::nv12,        PixelFormat::rgb8,        PixelFormat::bgr8,
    PixelFormat::bayer_rggb8, PixelFormat::bayer_bggr8, PixelFormat::bayer_gbrg8, PixelFormat::bayer_grbg8,
    PixelFormat::mjpeg,       PixelFormat::grey8,       PixelFormat::grey16};

}  // namespace lumigraft::capture
