#pragma once
// RGB pictures as an H.264 stream of low latency, through libavcodec and x264: constrained baseline, Annex B, one slice
// thread, no look-ahead, so that every picture comes out of the call that brought it in.
//
// Times may be uneven. Every key picture carries its parameter sets, so a viewer can begin at any of them. An odd last
// column or row is left out: 4:2:0 has none.
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "capture/image.h"

namespace lumigraft::server {

class H264Encoder {
 public:
  H264Encoder(int width, int height);
  ~H264Encoder();

  struct AccessUnit {
    bool key = false;
    std::vector<std::uint8_t> bytes;  ///< Annex B
  };
  /// `time_ns` must grow. A key picture is made when asked for, and 2 s after the last one. Throws std::runtime_error.
  AccessUnit encode(const capture::Image<std::uint8_t>& srgb, std::int64_t time_ns, bool key);

  /// For WebCodecs, as avc1.42c01e: profile, constraints and level of the last parameter set. Empty before the first.
  const std::string& codec_string() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::server
