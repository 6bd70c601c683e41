#pragma once
// Encodes a frame into the stream messages that viewers requested; each kind and size once for all viewers. H.264 is
// not encoded while none of its viewers can be sent a picture: what is encoded and not sent would cost a key frame.
#include <array>
#include <chrono>
#include <memory>
#include <optional>
#include <vector>

#include "capture/image.h"
#include "server/metrics/metrics.h"
#include "server/metrics/usual_duration.h"
#include "server/stream/encode_h264.h"
#include "server/stream/encode_jpeg.h"
#include "server/stream/protocol.h"

namespace lumigraft::server {

/// A composited frame to send to viewers.
struct ShownFrame {
  std::shared_ptr<const capture::Image<std::uint8_t>> srgb;
  std::uint32_t sequence = 0;
  bool passed_through = false;
  std::chrono::steady_clock::time_point captured;
};

class EncodeStage {
 public:
  EncodeStage(int jpeg_quality, EncoderDemand& demand, Metrics& metrics);

  /// Throws std::runtime_error where an encoder fails; the next call restarts that encoder.
  std::vector<std::shared_ptr<const StreamMessage>> encode(const ShownFrame& frame);

 private:
  using Clock = std::chrono::steady_clock;
  using Messages = std::vector<std::shared_ptr<const StreamMessage>>;

  struct H264Stream {
    std::optional<H264Encoder> encoder;
    int width = 0, height = 0;
    bool bounded = false;
    std::string codec_string;
    Clock::time_point last_asked_key{}, last_encoded{};
    UsualDuration period;  ///< between pictures that are encoded
  };

  void encode_size(const ShownFrame& frame, StreamSize size, Messages& out);
  void encode_h264(const ShownFrame& frame, StreamSize size, Messages& out);
  void prepare(H264Stream& stream, const ShownFrame& frame, int rate_kbit_s, Clock::time_point now);

  EncoderDemand& demand_;
  Metrics& metrics_;
  JpegEncoder jpeg_;
  std::array<H264Stream, 2> h264_;  ///< by StreamSize
};

/// The same time in nanoseconds since 1970 UTC.
std::int64_t unix_time_ns(std::chrono::steady_clock::time_point moment);

}  // namespace lumigraft::server
