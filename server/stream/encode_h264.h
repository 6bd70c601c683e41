#pragma once
// Encodes RGB frames as a low-latency H.264 stream with libavcodec and x264: constrained baseline, Annex B, one slice
// thread, no look-ahead, so that every call to encode() returns the frame it was given.
//
// Without a bound, quality is constant. With one, it is lowered where a picture would need more bits than the bound
// permits: a leaky bucket (the video buffering verifier of H.264, annex C) with a refill per picture.
//
// Frame intervals may vary. Every key frame carries its parameter sets, so a viewer can start at any key frame. An odd
// last column or row is cropped, because 4:2:0 needs even sizes.
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/image.h"

namespace lumigraft::server {

class H264Encoder {
 public:
  struct Bound {
    double picture_bits = 0;  ///< at most, on average
    double burst_bits = 0;    ///< of a picture after smaller ones, at most: such as a key frame
  };

  H264Encoder(int width, int height, std::optional<Bound> bound = std::nullopt);
  ~H264Encoder();

  /// From the next frame on. Only of an encoder that began with a bound: x264 cannot begin to count later.
  void change_bound(const Bound& bound);

  struct AccessUnit {
    bool key = false;
    std::vector<std::uint8_t> bytes;  ///< Annex B
  };
  /// `time_ns` must increase. Makes a key frame when `key` is set, and when the last one is 2 s old. Throws
  /// std::runtime_error.
  AccessUnit encode(const capture::Image<std::uint8_t>& srgb, std::int64_t time_ns, bool key);

  /// The codec string for WebCodecs, such as avc1.42c01e: profile, constraints and level of the last parameter set.
  /// Empty before the first frame.
  const std::string& codec_string() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::server
