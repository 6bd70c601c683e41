#pragma once
// Encodes RGB frames as JPEG files with TurboJPEG.
#include <cstdint>
#include <vector>

#include "capture/image.h"

namespace lumigraft::server {

class JpegEncoder {
 public:
  explicit JpegEncoder(int quality);
  ~JpegEncoder();
  /// 4:2:0. Throws std::runtime_error where the library fails.
  std::vector<std::uint8_t> encode(const capture::Image<std::uint8_t>& srgb);

 private:
  int quality_;
  void* handle_;
};

}  // namespace lumigraft::server
