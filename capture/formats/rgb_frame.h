#pragma once
// Converts libav's decoded frames to RGB. Included by .cpp files alone.
#include <cstdint>
#include <vector>

#include "capture/formats/libav_pointers.h"
#include "capture/image.h"

namespace lumigraft::capture {

class RgbFrame {
 public:
  /// 8 bits per channel, from any of libav's pixel formats. BT.601 unless the frame says BT.709. Empty if libav cannot.
  Image<std::uint8_t> convert(const AVFrame& frame, bool full_range);

 private:
  LibavScaler scaler_;
  std::vector<std::uint8_t> padded_;
};

}  // namespace lumigraft::capture
