#pragma once
// Encodes a frame into the stream messages that viewers requested; each kind once for all viewers.
#include <chrono>
#include <memory>
#include <optional>
#include <vector>

#include "capture/image.h"
#include "server/metrics/metrics.h"
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
  std::shared_ptr<const StreamMessage> message(const ShownFrame& frame, StreamKind kind,
                                               std::span<const std::uint8_t> payload) const;
  void encode_h264(const ShownFrame& frame, std::vector<std::shared_ptr<const StreamMessage>>& out);

  EncoderDemand& demand_;
  Metrics& metrics_;
  JpegEncoder jpeg_;
  std::optional<H264Encoder> h264_;
  int width_ = 0, height_ = 0;
  std::string codec_string_;
  std::chrono::steady_clock::time_point last_asked_key_{};
};

/// The same time in nanoseconds since 1970 UTC.
std::int64_t unix_time_ns(std::chrono::steady_clock::time_point moment);

}  // namespace lumigraft::server
