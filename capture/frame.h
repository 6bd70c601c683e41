#pragma once
// What sensors deliver. Frames are immutable once published; stages share them through shared_ptr<const ...>.
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "capture/formats/pixel_format.h"
#include "capture/image.h"

namespace lumigraft::capture {

enum class Stream { color, depth, fisheye };

struct Stamp {
  std::int64_t time_ns = 0;       ///< the device's clock; for recordings the recorded time
  std::int64_t host_time_ns = 0;  ///< steady clock of this host at arrival
  std::uint64_t sequence = 0;     ///< counts up by one per delivered picture of this stream; a gap is a lost picture
};

/// A colour or fish-eye picture. Exactly one of `encoded` and `radiance` is filled.
struct Picture {
  Stamp stamp;
  Stream stream = Stream::color;
  double exposure = 1.0;  ///< linear value 1.0 is reached at radiance 1/exposure (W/sr/m² per channel); encoded only
  Image<std::uint8_t> encoded;  ///< 8-bit R G B under the camera's response
  Image<float> radiance;        ///< linear sRGB radiance, W/sr/m² per channel, R G B
  /// What `encoded` was made from, where the camera gave something else.
  std::shared_ptr<const CameraPicture> original = nullptr;
};

/// Depth along the colour camera's z axis, on the colour camera's pixels (registration is done in capture).
struct DepthPicture {
  Stamp stamp;
  Image<float> depth_m;  ///< 1 channel; 0 = no measurement
};

/// Everything that belongs to one colour frame. Colour is always there; depth and fish-eye may be missing.
struct FrameSet {
  std::uint64_t index = 0;   ///< 0, 1, 2 ... of the colour stream, counting skipped frames too
  std::int64_t time_ns = 0;  ///< the colour picture's device time
  std::shared_ptr<const Picture> color;
  std::shared_ptr<const DepthPicture> depth;
  std::vector<std::shared_ptr<const Picture>> fisheye;  ///< one picture, or the exposures of one bracket
  std::vector<std::string> warnings;                    ///< what went wrong with this frame, one line each
};

}  // namespace lumigraft::capture
