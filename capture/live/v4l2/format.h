#pragma once
// How a V4L2 camera's pictures lie in memory, agreed with its driver. Included by .cpp files alone.
#include <array>

#include "capture/live/v4l2/device.h"
#include "capture/session/stream_spec.h"

namespace lumigraft::capture::v4l2 {

struct Agreed {
  PixelFormat format = PixelFormat::rgb8;
  int planes = 1;                          ///< 2: nv12 whose halves lie in memory of their own
  std::array<std::size_t, 2> row_bytes{};  ///< of each; 0 for mjpeg
  bool padded = false;                     ///< rows are longer than their pixels
};

/// Sets format, size and rate. Throws InputError for what the camera does not offer.
Agreed agree(const Device& device, const StreamSpec& spec);

}  // namespace lumigraft::capture::v4l2
