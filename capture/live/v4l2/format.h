#pragma once
// Negotiates pixel format, frame size and rate with a V4L2 driver. Included by .cpp files alone.
#include <array>

#include "capture/live/v4l2/device.h"
#include "capture/session/stream_spec.h"

namespace lumigraft::capture::v4l2 {

struct NegotiatedFormat {
  PixelFormat format = PixelFormat::rgb8;
  int planes = 1;                          ///< 2: nv12 with separate memory for luma and chroma
  std::array<std::size_t, 2> row_bytes{};  ///< of each plane; 0 for mjpeg
  bool padded = false;                     ///< rows have padding after their pixels
};

/// Sets format, size and rate. Throws InputError for what the camera does not offer.
NegotiatedFormat negotiate_format(const Device& device, const StreamSpec& spec);

}  // namespace lumigraft::capture::v4l2
