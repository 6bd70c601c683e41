#pragma once
// Properties that a session requires of one stream, and two helper functions of all sources.
#include <chrono>
#include <cstdint>
#include <string>

#include "capture/frame.h"
#include "capture/session/camera_settings.h"

namespace lumigraft::capture {

struct StreamSpec {
  Stream stream = Stream::color;
  int width = 0, height = 0;
  double exposure = 1.0;         ///< colour and fish-eye: of frames for which the source reports none
  double unit_m = 0.001;         ///< depth: metres per count
  bool registered = true;        ///< depth: the device itself puts depth on the colour camera's pixels
  CameraSettings settings = {};  ///< of live cameras
  std::string serial = {};       ///< a live camera that reports another one is refused; empty: any
};

inline std::string size_text(int width, int height) {
  return std::to_string(width) + "x" + std::to_string(height) + " pixels";
}

inline std::int64_t steady_now_ns() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
}

}  // namespace lumigraft::capture
