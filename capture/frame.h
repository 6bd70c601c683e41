#pragma once
// Frames of colour, fish-eye and depth cameras. They are immutable once published; stages share them through
// shared_ptr<const ...>.
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/formats/pixel_format.h"
#include "capture/image.h"

namespace lumigraft::capture {

enum class Stream { color, depth, fisheye };
inline constexpr std::array kStreams = {Stream::color, Stream::depth, Stream::fisheye};

struct Stamp {
  std::int64_t time_ns = 0;       ///< device clock; in recordings the recorded time
  std::int64_t host_time_ns = 0;  ///< steady clock of this host at arrival
  std::uint64_t sequence = 0;     ///< increases by one per frame of this stream; a gap is a lost frame
};

/// A colour or fish-eye frame. Exactly one of `encoded` and `radiance` is filled.
struct Frame {
  Stamp stamp = {};
  Stream stream = Stream::color;
  double exposure = 1.0;  ///< radiance 1/exposure (W/sr/m² per channel) has linear value 1.0; for `encoded` only
  /// From the exposure of the first row to that of the last, as the camera reports it; 0: all at once. Empty: not
  /// reported.
  std::optional<double> readout_s = std::nullopt;
  Image<std::uint8_t> encoded = {};  ///< 8-bit R G B, encoded by the camera's response
  Image<float> radiance = {};        ///< linear sRGB radiance, W/sr/m² per channel, R G B
  /// The camera's own pixel format, from which `encoded` was converted; null if the camera delivers RGB.
  std::shared_ptr<const RawFrame> original = nullptr;
};

/// Depth as measured by the sensor, before registration to colour.
struct RawDepth {
  Stamp stamp;
  Image<std::uint16_t> counts;  ///< 0 = no measurement
};

/// Depth along the colour camera's z axis, on the colour camera's pixels.
struct DepthFrame {
  Stamp stamp;
  Image<float> depth_m;  ///< 1 channel; 0 = no measurement
};

/// One frame, or the exposures of one bracket.
using FisheyeFrames = std::vector<std::shared_ptr<const Frame>>;

/// One colour frame and the depth and fish-eye frames of its moment, which may be missing.
struct FrameSet {
  std::uint64_t index = 0;   ///< sequence number of the colour stream, skipped frames included
  std::int64_t time_ns = 0;  ///< device time of the colour frame
  std::shared_ptr<const Frame> color;
  /// Linear pixel value of `color` over exposure × radiance, per channel: changes of exposure and white balance that
  /// the camera does not report. Estimated by reconstruct; 1 until then.
  std::array<float, 3> color_gain = {1, 1, 1};
  /// vignetting_gain() of the colour camera, as the session states it or as reconstruct estimates it; null: none.
  std::shared_ptr<const Image<float>> color_vignetting;
  /// False if something covers the colour camera's lens, or too little light is left: `color` shows nothing of the
  /// room's colours. Found by reconstruct.
  bool color_shows_room = true;
  std::shared_ptr<const RawDepth> raw_depth;
  std::shared_ptr<const DepthFrame> depth;  ///< raw_depth after DepthRegistration; null before
  FisheyeFrames fisheye;
  std::vector<std::string> warnings;  ///< one line each
};

}  // namespace lumigraft::capture
